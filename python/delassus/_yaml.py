# SPDX-License-Identifier: BSD-3-Clause
"""Python's values as YAML in one line."""
import json
from collections.abc import Mapping, Sequence

import numpy as np


def yaml_of(value) -> str:
    """Maps, sequences, arrays, numbers, texts, bools and None; raises TypeError for anything else."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(str(key), ensure_ascii=False)}: {yaml_of(entry)}"
                               for key, entry in value.items()) + "}"
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
        return repr(number)
    raise TypeError(f"a scene cannot hold a value of type {type(value).__name__}")
