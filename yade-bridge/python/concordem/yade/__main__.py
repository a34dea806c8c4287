"""``python3 -m concordem.yade build``: the native plugin for the YADE of this machine; ``check``: what a script may expect."""

import sys

from ._build import main

sys.exit(main(sys.argv[1:]))
