from spack.package import *


class Libcsv(AutotoolsPackage):
    """A small and fast library that reads and writes CSV data."""

    homepage = "https://github.com/rgamble/libcsv"
    url = "https://deb.debian.org/debian/pool/main/libc/libcsv/libcsv_3.0.3+dfsg.orig.tar.gz"

    license("LGPL-2.1-or-later")

    # As in Debian 12's signed libcsv_3.0.3+dfsg-6.dsc.
    version("3.0.3", sha256="06fddfaca720a4be7603bad63eb1833bca5b6c5a69b42b1c518a02cda2a73aef", url=url)

    depends_on("c", type="build")
