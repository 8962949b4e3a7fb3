"""What a program frozen by PyInstaller needs of debulk.

Public modules are imported by their names when they are first used, and pages are made from templates. The studies and
this hook are for developers only.
"""

from PyInstaller.utils.hooks import collect_data_files, collect_submodules, copy_metadata

datas = collect_data_files("debulk") + copy_metadata("debulk")
hiddenimports = collect_submodules("debulk", lambda name: not name.startswith("debulk.pyinstaller"))
