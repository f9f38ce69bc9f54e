"""What the wheel says of itself."""

import email
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class Metadata(unittest.TestCase):
    def test_the_wheel_says_who_made_it_and_under_which_licences(self):
        with tempfile.TemporaryDirectory() as folder:
            stage = Path(folder)
            for file in ("bindings/python/pyproject.toml", "bindings/python/setup.py", "LICENSE"):
                shutil.copy(ROOT / file, stage)
            (stage / "VERSION").write_text("1.2.3\n")
            (stage / "tpmkit").mkdir()
            for file in ("__init__.py", "__main__.py", "py.typed"):
                shutil.copy(ROOT / "bindings/python/tpmkit" / file, stage / "tpmkit")
            code = "from setuptools import build_meta; print(build_meta.prepare_metadata_for_build_wheel('.'))"
            made = subprocess.run([sys.executable, "-c", code], cwd=stage, capture_output=True, text=True, check=True)
            info = stage / made.stdout.split()[-1]
            said = email.message_from_string((info / "METADATA").read_text())
            scripts = (info / "entry_points.txt").read_text()
        self.assertEqual((said["Name"], said["Version"]), ("tpmkit", "1.2.3"))
        self.assertEqual(said["Author"], "The tpmkit authors")
        self.assertRegex(said["License"], r"^MIT \(sources\).* GPL: docs/licences.md$")
        self.assertIn("only under the terms of the GPL", " ".join((ROOT / "docs/licences.md").read_text().split()))
        self.assertEqual(set(said.get_all("Requires-Dist")), {"numpy", "pandas", "xarray"})
        self.assertIsNone(said["Home-page"])
        self.assertIn("tpm = tpmkit.__main__:main", scripts)


if __name__ == "__main__":
    unittest.main()
