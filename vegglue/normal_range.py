"""The range that holds 95 % of a normal distribution, as all intervals of this program are told."""

# Standard deviations on either side of the mean.
NORMAL95 = 1.96
