# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs the tests of a file."""
import sys
import time
import traceback


def main(names):
    """Runs all functions called test_*; exits with 1 if one failed."""
    failed = 0
    for name, test in names.items():
        if name.startswith("test_") and (len(sys.argv) < 2 or sys.argv[1] in name):
            start = time.time()
            try:
                test()
                print(f"ok      {name} ({time.time() - start:.2f} s)", flush=True)
            except Exception:
                failed += 1
                print(f"FAILED  {name}", flush=True)
                traceback.print_exc()
    if failed:
        sys.exit(1)
