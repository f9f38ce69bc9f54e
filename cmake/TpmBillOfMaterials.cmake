# The bill of materials of the installed program, share/doc/tpmkit/tpmkit.spdx.json (SPDX 2.3), and the notices of what is
# compiled into it (docs/licences.md). Made when the program is installed, of the machine that it was built on. Where
# there is no Python the installation says so and goes on without them. In build/...: ninja bill_of_materials
if(TPM_SANITIZE OR BUILD_SHARED_LIBS)  # rooms as shared libraries are not installed
  return()
endif()
find_package(Python3 COMPONENTS Interpreter QUIET)
if(NOT Python3_Interpreter_FOUND)
  message(STATUS "No Python: no bill of materials is installed")
  return()
endif()
set(TPM_SBOM_COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/scripts/make_sbom.py)
set(TPM_SBOM_DYNAMIC)
if(NOT TPM_HDF5_ARCHIVES)
  set(TPM_SBOM_DYNAMIC --dynamic libhdf5-dev --dynamic libaec-dev)
endif()
add_custom_target(bill_of_materials
  COMMAND ${TPM_SBOM_COMMAND} $<TARGET_FILE:tpm> ${PROJECT_BINARY_DIR}/tpmkit.spdx.json
          ${PROJECT_BINARY_DIR}/third_party.txt ${TPM_SBOM_DYNAMIC}
  VERBATIM)
add_dependencies(bill_of_materials tpm)
# Of the file that was installed: stripping it has changed its check sum.
install(CODE "
  set(document \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/doc/tpmkit)
  file(MAKE_DIRECTORY \${document})
  execute_process(COMMAND ${TPM_SBOM_COMMAND} \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}/tpm
    \${document}/tpmkit.spdx.json \${document}/third_party.txt ${TPM_SBOM_DYNAMIC} COMMAND_ERROR_IS_FATAL ANY)"
  COMPONENT program)
