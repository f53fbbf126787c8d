"""The parts of `twin calibrate`: one file for each thing that is measured."""
