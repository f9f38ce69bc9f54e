#!/usr/bin/env python3
"""Whether each document of a list has the form that a JSON Schema (draft 7) says: a line of 1 or 0 for each.

    python3 tests/programs/schema_verdicts.py SCHEMA DOCUMENTS
"""
import json
import sys

from jsonschema import Draft7Validator

with open(sys.argv[1], encoding="utf-8") as file:
    schema = json.load(file)
with open(sys.argv[2], encoding="utf-8") as file:
    documents = json.load(file)
Draft7Validator.check_schema(schema)
validator = Draft7Validator(schema)
for document in documents:
    print(int(validator.is_valid(document)))
