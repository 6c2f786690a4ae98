"""Membership functions, rules and hybrid learning: what ``ANFIS`` is made of."""
