# The fuzzer with only those sources instrumented that read files: built in a minute instead of six. All else
# comes from a library that is there (TPM_FUZZ_ARCHIVE). What is in both is taken from here, because it stands first.
set(readers_core error text units)
set(readers_store check_sum contained delimited document_place file file_roles hdf5_contents hdf5_driver hdf5_handle
    hdf5_reader json row_log schema checksum zip_archive)
set(readers_curve assemble contact description drive_pieces header_words import import_digitizer import_jpk import_machine import_wpd_json
    jpk_channel jpk_properties recording_file rows)
set(readers_law law_file)
set(readers_network mesh_coordinate mesh_file mesh_polygon mesh_surface obj_file stl_file triangle_mesh)
set(readers_scene contact_blocks experiment_blocks experiment_scene material_block organ_block place_function protocol_file scene
    tissue_blocks)
set(readers_simulate checkpoint)
set(readers_fit config config_data config_noise config_parameters petab)
set(readers_plan operations)
set(readers_haptics recording session session_phases)
set(readers_study audit audit_kinds audit_tables claim_reader claims design_file expression organ_study_file)
set(readers_sweep block_log parameter_values sweep_file)
foreach(folder core store curve law network scene simulate fit plan haptics study sweep)
  list(TRANSFORM readers_${folder} PREPEND src/tpm/${folder}/)
  list(TRANSFORM readers_${folder} APPEND .cpp)
  add_library(fuzzed_${folder} OBJECT ${readers_${folder}})
  tpm_folder_options(fuzzed_${folder})
  tpm_compile_together(fuzzed_${folder})
  target_link_libraries(fuzz_inputs PRIVATE fuzzed_${folder})
endforeach()
target_include_directories(fuzz_inputs PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
target_link_libraries(fuzz_inputs PRIVATE ${TPM_FUZZ_ARCHIVE} Eigen3::Eigen nlohmann_json::nlohmann_json fmt::fmt
                                          ${TPM_PRIVATE_LIBRARIES} tpm_options)
target_link_options(fuzz_inputs PRIVATE -Wl,-z,muldefs)
