"""What experiments and tests need and a cell does not: it is in no wheel.

`varied` is a second family of virtual layups, with the faults, filters and mistakes that spoil an inspector's input;
`third` is a third one, written from the laws of the model without a look at the other two;
`study` measures the solver's error against its run time; `json_schema` makes the schema files that the package has.
Programs in bench/ and the tests import it as ``lab``.
"""
