# SPDX-License-Identifier: BSD-3-Clause
"""Python's values as YAML in one line."""
import json
import re
from collections.abc import Mapping, Sequence

import numpy as np


_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")
_NOT_TEXTS = {"true", "false", "yes", "no", "on", "off", "y", "n", "null"}


def key_of(key) -> str:
    """A key, in quotes where it needs them."""
    key = str(key)
    if _PLAIN.fullmatch(key) and key.lower() not in _NOT_TEXTS:
        return key
    return json.dumps(key, ensure_ascii=False)


def yaml_of(value) -> str:
    """Maps, sequences, arrays, numbers, texts, bools and None; raises TypeError for anything else."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key_of(key)}: {yaml_of(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, np.ndarray):
        return yaml_of(value.tolist())
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(yaml_of, value)) + "]"
    if value is None:
        return "null"
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        number = float(value)
        if number != number:
            return ".nan"
        if number in (float("inf"), float("-inf")):
            return ".inf" if number > 0 else "-.inf"
        text = repr(number)
        return text.replace("e", ".0e") if "e" in text and "." not in text else text  # YAML wants the point
    raise TypeError(f"a scene cannot hold a value of type {type(value).__name__}")
