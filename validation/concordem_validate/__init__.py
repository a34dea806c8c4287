"""Runs the same particle simulations in several codes, and compares the results.

Read in this order: `case` (what a case is), `registry` and `engines` (what runs), `start` (what all begin with), `runner` (how it runs, and what is
kept), `meeting` and `norms` (how two curves become a number), `compare` (verdicts), `rounds` and `report` (what is written). The rest serves
these: `tables`, `quantity`, `result`, `programs`, `process`; or is a command: `baseline`, `difference`, `lint`, `mutate`, `history`, `starter`,
`pytest_plugin`.
"""
