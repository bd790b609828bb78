"""One file per verb of the command line; `testbed.cli.VERBS` lists them."""
