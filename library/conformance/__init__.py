"""Properties that every world has: of its record, its levels, its observations and its steps.

`pt.testing.check_world` checks them all; the tests of this program check each of them in each world.
"""
