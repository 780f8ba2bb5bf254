"""How many digits the models keep, over the whole domain that a fit can reach: the atlas and what it is measured with.

``oracle`` holds the models in 40-digit arithmetic and needs mpmath, which the extra ``brdfit[stability]`` installs.
"""
