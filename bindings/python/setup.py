# Packs what scripts/wheel.sh has put together into one wheel: module, program and data, for this Python
# and this machine. It builds nothing itself. What the wheel says of itself: pyproject.toml.
from pathlib import Path

from setuptools import Distribution, setup


class Binary(Distribution):
    def has_ext_modules(self):
        return True


package = Path("tpmkit")
files = [str(p.relative_to(package)) for p in sorted(package.rglob("*")) if p.is_file() and p.suffix != ".py"]
setup(packages=["tpmkit"], package_data={"tpmkit": files}, distclass=Binary, zip_safe=False)
