#!/usr/bin/env python3
"""Runs campaigns (`decant campaign`) from a source tree, with the command that is built here.

    campaign.py fuzz --backend hash --cases 10000 --folder build/campaign

Takes build/release/bin/decant, or build/host's, where --decant names no other. Needs distributed, h5py and numpy.
"""

import sys

from package_source import ROOT, campaign_package


def main():
    words = sys.argv[1:]
    if not any(word.split("=")[0] == "--decant" for word in words):
        built = [ROOT / "build" / preset / "bin" / "decant" for preset in ("release", "host")]
        found = next((command for command in built if command.is_file()), None)
        if found and len(words) > 1:
            words += ["--decant", str(found)]
    campaign_package()
    from decant.campaign.command import main as run

    return run(words, prog="campaign.py")


if __name__ == "__main__":
    sys.exit(main())
