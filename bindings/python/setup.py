# Packs what scripts/wheel.sh has put together into one wheel: module, program and data, for this Python
# and this machine. It builds nothing itself.
from pathlib import Path

from setuptools import Distribution, setup


class Binary(Distribution):
    def has_ext_modules(self):
        return True


package = Path("tpmkit")
files = [str(p.relative_to(package)) for p in sorted(package.rglob("*")) if p.is_file() and p.suffix != ".py"]
setup(
    name="tpmkit",
    version=Path("VERSION").read_text().strip(),
    description="Soft tissue: laws from recordings, organs of spheres, contacts for haptic loops",
    author="The tpmkit authors",
    license="MIT",
    packages=["tpmkit"],
    package_data={"tpmkit": files},
    entry_points={"console_scripts": ["tpm = tpmkit.__main__:main"]},
    python_requires=">=3.9",
    install_requires=["numpy", "pandas", "xarray"],
    distclass=Binary,
    zip_safe=False,
)
