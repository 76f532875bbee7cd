"""The comparison of controllers in Shirazi et al. (2012), done anew from end to end.

experiment      the runs: motions, intensities, laws; peak and RMS of each
identification  how well each damper law fits a damper that is known
claims          what the paper's text states, each with a verdict by the numbers
pictures        its Figs 13 to 17, and a summary
page            its Tables IV and V, and one HTML file with everything
"""
