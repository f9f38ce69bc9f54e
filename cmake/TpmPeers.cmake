# tpm_peers: other engines on one problem (docs/accuracy.md). Optional: nothing else needs them.
# Debian: libmujoco-dev, libbullet-dev.
option(TPM_PEERS "Build tpm_peers, which runs MuJoCo and Bullet beside tpm" OFF)
if(TPM_PEERS)
  find_package(mujoco REQUIRED)
  find_package(PkgConfig REQUIRED)
  # The double precision build: its soft body is another library than the usual one.
  pkg_check_modules(TPM_BULLET REQUIRED IMPORTED_TARGET bullet-float64)
  file(GLOB TPM_PEER_SOURCES CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/apps/peers/*.cpp)
  add_executable(tpm_peers ${TPM_PEER_SOURCES})
  # As system headers: their warnings are not ours.
  target_include_directories(tpm_peers SYSTEM PRIVATE ${TPM_BULLET_INCLUDE_DIRS})
  target_link_libraries(tpm_peers PRIVATE tpmkit mujoco::mujoco PkgConfig::TPM_BULLET tpm_options)
endif()
