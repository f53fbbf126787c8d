"""The command line `twin`: one file per verb."""
