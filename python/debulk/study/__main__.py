"""``python -m debulk.study``: the whole study, into bench/study."""

from debulk.study import main

main()
