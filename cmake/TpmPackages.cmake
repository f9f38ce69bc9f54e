# Debian packages (cpack), with manual pages and completion made from what the commands say of themselves:
#     cmake --preset release -DTPM_PACKAGES=ON -DTPM_PYTHON=ON -DCMAKE_INSTALL_LIBDIR=lib/x86_64-linux-gnu
#                            -DTPM_PYTHON_INSTALL:STRING=lib/python3/dist-packages
# scripts/packages_debian.sh does so.
if(NOT TPM_PACKAGES)
  return()
endif()

find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(TPM_HELP ${PROJECT_BINARY_DIR}/command_help)
add_custom_command(OUTPUT ${TPM_HELP}/tpm
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${TPM_HELP}/man
  COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/scripts/command_help.py $<TARGET_FILE:tpm> man ${TPM_HELP}/man
  COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/scripts/command_help.py $<TARGET_FILE:tpm> completion ${TPM_HELP}
  DEPENDS tpm ${PROJECT_SOURCE_DIR}/scripts/command_help.py VERBATIM)
add_custom_target(command_help ALL DEPENDS ${TPM_HELP}/tpm)
install(DIRECTORY ${TPM_HELP}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${TPM_HELP}/tpm DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
install(FILES ${TPM_HELP}/_tpm DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
install(FILES ${TPM_HELP}/tpm.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)

# What Debian wants beside every package: copyright and changelog.
find_program(TPM_GZIP gzip REQUIRED)
set(TPM_CHANGELOG ${PROJECT_BINARY_DIR}/changelog.gz)
execute_process(COMMAND ${TPM_GZIP} -9nc ${PROJECT_SOURCE_DIR}/packaging/debian/changelog OUTPUT_FILE ${TPM_CHANGELOG}
                COMMAND_ERROR_IS_FATAL ANY)
# tpm_package(COMPONENT NAME SECTION SUMMARY DESCRIPTION DEPENDS...); lines of DESCRIPTION are kept
function(tpm_package component name section summary description)
  string(TOUPPER ${component} upper)
  string(REPLACE ";" ", " depends "${ARGN}")
  install(FILES ${PROJECT_SOURCE_DIR}/packaging/debian/copyright ${TPM_CHANGELOG}
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component})
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${depends}" PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}\n${description}" PARENT_SCOPE)
endfunction()
tpm_package(program tpmkit science "soft-tissue models: fitting, simulation, haptic loop"
  "The program tpm fits laws to recordings, with intervals and verdicts,
simulates organs of spheres, runs sweeps, and renders tissue on a haptic
device."
  python3)
tpm_package(library libtpmkit-haptics1 libs "soft tissue for haptic loops, C interface"
  "The library that steps a contact of tpmkit within a servo loop, without
allocation, lock or exception. Sessions are checked with the schemas of the
package tpmkit."
  "tpmkit (= ${PROJECT_VERSION})")
tpm_package(development libtpmkit-dev libdevel "soft-tissue models, files for development"
  "Headers, static libraries (one for each component, from base to
haptics) and CMake package of tpmkit, and the header of its C interface
for haptic loops."
  "libtpmkit-haptics1 (= ${PROJECT_VERSION})" libeigen3-dev libfmt-dev libceres-dev
  libsundials-dev libhdf5-dev libcsv-dev libmuparser-dev libcpp-httplib-dev libssl-dev libtbb-dev
  libdeflate-dev libmetis-dev libminizip-dev zlib1g-dev)
tpm_package(python python3-tpmkit python "soft-tissue models from Python"
  "The package tpmkit fits laws, runs scenes and sweeps, and steps contacts.
Results are DataFrames and xarray Datasets."
  "tpmkit (= ${PROJECT_VERSION})" "python3 (>= 3.11)" "python3 (<< 3.12)" python3-numpy python3-pandas python3-xarray)

# CPack packs the finished build and builds nothing: it does not need the tests.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tpmkit)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGE_VENDOR "The tpmkit authors")
set(CPACK_PACKAGE_CONTACT "The tpmkit authors <authors@tpmkit.invalid>")
# The program, the library and the module find their data from where they are, wherever that is.
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program library development)
if(TPM_PYTHON AND TPM_PYTHON_INSTALL)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
# CPack calls ldconfig in scripts of its own, which Debian wants as a trigger: both do no harm.
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/triggers)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/lintian-overrides RENAME libtpmkit-haptics1
        DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides COMPONENT library)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "python3-numpy, python3-matplotlib")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-matplotlib, python3-h5py, python3-h5netcdf")
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
# Equal sources and compilers give equal packages.
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
include(CPack)
