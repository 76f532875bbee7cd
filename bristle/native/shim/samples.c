/* Placeholder until the next step. */
#include "slave.h"
int read_samples(Slave *slave, Text *wrong) { (void)slave; (void)wrong; return 1; }
