"""What ``Analytic`` is made of: which form fits an arm, and the forms that are not native.

families: the arm's family and its numbers; decoupled: three slides and three turns; parallel_arm:
tasks of arms with parallel axes; extension: virtual joints for shorter arms and partial tasks;
redundant, held: seven joints; bare: far bases and tools; settle: least errors on the arm itself.
"""
