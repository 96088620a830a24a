"""The checksum of the attributes of a results file and of what describes its columns, which is an attribute itself.

All of them are fixed when the file is created, so that the checksum is in the file before it gets its name.
"""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256

from explore.model.columns import Attribute, Column
from explore.results.store.study_record import contains_only, parse_json

#: Attribute with the names of the attributes that are checked, and the checksum.
SEAL = "checked"
#: Attribute with the offset of the first commit word, which another program's copy may have elsewhere.
COMMIT_OFFSET = "commit_offset"


def seal_text(attributes: Mapping[str, Attribute], columns: Sequence[Column]) -> str:
    """The text of the checksum of some attributes and of all columns; its length does not depend on numbers."""
    described = [[c.name, c.unit, c.long_name, c.role, c.dtype, c.labels] for c in columns]
    content = json.dumps([dict(attributes), described], sort_keys=True).encode()
    return json.dumps({"attributes": sorted(attributes), "sha256": sha256(content).hexdigest()})


def check_seal(attributes: Mapping[str, Attribute], columns: Sequence[Column], *, is_required: bool) -> None:
    """Raise ValueError unless the attributes have their checksum; others may have been added by other programs."""
    if SEAL not in attributes and not is_required:
        return
    content = parse_json(f"attribute {SEAL}", attributes.get(SEAL, "{}"))
    names = content.get("attributes", ()) if isinstance(content, dict) else ()
    if not names or not contains_only(names, list, str):
        raise ValueError("the checksum of its attributes is missing")
    found = {name: attributes[name] for name in names if name in attributes}
    if attributes[SEAL] != seal_text(found, columns):
        raise ValueError("its attributes do not have the checksum that they were written with")
