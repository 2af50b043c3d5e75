"""The range that holds 95 % of a normal distribution, as of all intervals that this program reports."""

# Standard deviations on either side of the mean.
NORMAL95 = 1.96
