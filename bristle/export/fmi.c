/* What a page calls besides the functions of FMI: an instance whose messages go to the page. */

#include "fmi2.h"

__attribute__((import_module("bristle"), import_name("log"))) void page_log(int status,
                                                                            const char *text);

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging);

static void tell(void *page, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String text, ...) {
    (void)page, (void)name, (void)category;
    page_log((int)status, text);
}

static const fmi2CallbackFunctions CALLBACKS = {tell, 0, 0, 0, 0};

__attribute__((export_name("instantiate"))) fmi2Component instantiate(fmi2String name,
                                                                      fmi2String guid) {
    return fmi2Instantiate(name, fmi2CoSimulation, guid, "", &CALLBACKS, 0, 1);
}
