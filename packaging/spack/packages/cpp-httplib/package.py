from spack.package import *


class CppHttplib(CMakePackage):
    """An HTTP server and client; compiled, as the session's page links it."""

    homepage = "https://github.com/yhirose/cpp-httplib"
    url = "https://deb.debian.org/debian/pool/main/c/cpp-httplib/cpp-httplib_0.11.4+ds.orig.tar.xz"

    license("MIT")

    # As in Debian 12's signed cpp-httplib_0.11.4+ds-1+deb12u1.dsc.
    version("0.11.4", sha256="8b1a5df569003b6a4f24c68489bbda5c64aec94697bdc9ebba5d79408b2ae7eb", url=url)

    depends_on("cxx", type="build")
    depends_on("brotli")
    depends_on("openssl")
    depends_on("zlib")

    def cmake_args(self):
        return [self.define("BUILD_SHARED_LIBS", True), self.define("HTTPLIB_COMPILE", True)]

    @run_after("install")
    def add_pkgconfig(self):
        """tpmkit takes the flags that change the layout of its types from here; Debian adds the file as well."""
        folder = join_path(self.prefix.lib, "pkgconfig")
        mkdirp(folder)
        with open(join_path(folder, "cpp-httplib.pc"), "w") as file:
            file.write(
                f"prefix={self.prefix}\nName: cpp-httplib\nDescription: HTTP\nVersion: {self.version}\n"
                "Libs: -L${prefix}/lib -lhttplib\nCflags: -I${prefix}/include -DCPPHTTPLIB_OPENSSL_SUPPORT "
                "-DCPPHTTPLIB_ZLIB_SUPPORT -DCPPHTTPLIB_BROTLI_SUPPORT\n")
