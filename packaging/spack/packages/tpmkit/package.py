# Status: a test parses this recipe; it was never built, because Spack was not available. Names of variants were compared
# with a recipe of Spack of 2022 (sundials), versions were not: Spack may lack nanoflann 1.4 or Ceres 2.1, which Debian 12 has.
import os

from spack.package import *


class Tpmkit(CMakePackage):
    """Validation, parameter fitting and haptic replay of viscoelastic soft-tissue models."""

    # No archive has been published, so the source is the local one of scripts/source_tarball.sh, and the version has no
    # checksum:
    #     scripts/source_tarball.sh && spack install --no-checksum tpmkit
    # When you publish the archive, insert its address and sha256.
    url = "file://" + os.path.normpath(os.path.join(os.path.dirname(__file__), "../../../../dist/tpmkit-0.1.0.tar.gz"))

    maintainers()  # to be filled in
    license("MIT")

    version("0.1.0")

    variant("mpi", default=False, description="tpm sweep under mpirun")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("python@3.9:", type=("build", "run"))

    depends_on("boost@1.74:")
    depends_on("ceres-solver@2.1:2.2")
    depends_on("cli11@2.1:")
    depends_on("cpp-httplib@0.11.4")  # of this repository: Spack's own is headers only
    depends_on("eigen@3.4")
    depends_on("fmt@9")
    depends_on("hdf5@1.10: ~mpi +hl")
    depends_on("intel-tbb@2021:")
    depends_on("libcsv")  # of this repository: Spack has none
    depends_on("libdeflate@1.14:")
    depends_on("metis@5.1:")
    depends_on("minizip")
    depends_on("muparser@2.3:")
    depends_on("nanoflann@1.4")
    depends_on("nlohmann-json@3.11:")
    depends_on("openssl@3:")
    depends_on("sundials@6.4:6 +CVODES +IDA +klu ~mpi")
    depends_on("utf8cpp@3.2:")
    depends_on("zlib@1.2:")
    depends_on("mpi", when="+mpi")

    def cmake_args(self):
        return [
            self.define("TPM_TOGETHER", True),
            self.define("TPM_BUILD_TESTS", False),
            self.define_from_variant("TPM_MPI", "mpi"),
        ]

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def check_install(self):
        Executable(self.prefix.bin.tpm)("paper", "audit")
