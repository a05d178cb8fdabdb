#!/usr/bin/env python3
"""Refuses dependencies that can only be had under the GPL, LGPL or AGPL, or that state no licence (SPDX expression)."""

import json
import re
import subprocess
import sys


def main():
    metadata = ["cargo", "metadata", "--format-version", "1", "--locked"]
    packages = json.loads(subprocess.run(metadata, check=True, capture_output=True).stdout)["packages"]
    refused = [f"{p['name']} {p['version']}: {p['license']}" for p in packages if not acceptable(p["license"] or "")]
    print("\n".join(refused) if refused else f"licences of {len(packages)} packages: ok")
    return 1 if refused else 0


def acceptable(expression):
    """True when some choice among the alternatives of an SPDX expression has no GPL in it."""
    tokens = re.findall(r"[()]|[^\s()/]+|/", expression)
    words = {"(": "(", ")": ")", "AND": "and", "OR": "or", "/": "or"}
    exception = False  # "GPL-2.0 WITH exception" is still the GPL; what follows WITH is no licence
    formula = []
    for token in tokens:
        if not exception and token != "WITH":
            formula.append(words.get(token, str(re.match(r"[AL]?GPL", token, re.I) is None)))
        exception = token == "WITH"
    return bool(formula) and eval(" ".join(formula))  # only "True False and or ( )" can stand there


def test():
    for good in ["MIT", "MIT OR Apache-2.0", "MIT/Apache-2.0", "Apache-2.0 WITH LLVM-exception OR GPL-2.0",
                 "(MIT OR LGPL-2.1-or-later) AND Unicode-3.0"]:  # fmt: skip
        assert acceptable(good), good
    for bad in ["", "GPL-3.0", "AGPL-3.0-only", "MIT AND GPL-2.0", "(MIT OR ISC) AND LGPL-3.0",
                "GPL-2.0 WITH exception"]:  # fmt: skip
        assert not acceptable(bad), bad


if __name__ == "__main__":
    test()
    sys.exit(main())
