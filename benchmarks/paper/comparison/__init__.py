"""The comparison of controllers in Shirazi et al. (2012), done anew from end to end.

experiment      the runs: motions, intensities, laws; peak and RMS of each
identification  how well each damper law fits a damper that is known
claims          what the paper's text states, each with a verdict by the numbers
tables          its Tables IV and V, and the runs beyond the damper's stroke
cases           its Figs 14 to 17
pictures        Fig. 13, and pictures of our own
page            one HTML file with everything
"""
