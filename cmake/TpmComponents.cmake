# The components that are installed (docs/library.md): archives made of the folders of src/tpm, so that a program links
# no more than it uses. What only the program tpm needs (reports, sweeps, benchmarks, most studies) belongs to none.
#
#   core     units, protocols, materials, closed form, laws          Eigen, fmt
#   organ    scenes, networks, runs, files of curves and laws        core
#   fit      fits of configurations and recordings                   organ
#   haptics  devices, servo loop, sessions                           organ
set(TPM_COMPONENTS core organ fit haptics)

# Folders as a whole.
set(TPM_core_FOLDERS material shapes)
set(TPM_organ_FOLDERS core protocol solve model law curve formulation formulations store network scene simulate method
    reduce plan)
set(TPM_fit_FOLDERS fit)
set(TPM_haptics_FOLDERS device servo haptics)

# Sources of a folder that belong to another component than the rest of it, without ending.
set(TPM_core_OF_core dense_algebra error random text units version)
set(TPM_core_OF_protocol protocol)
set(TPM_core_OF_curve curve)
set(TPM_core_OF_model closed_form model)
set(TPM_core_OF_solve cardinal_weight creep_exact exponential_collocation exponential_quadrature exponential_sum
    lagrange_basis laplace_contour mittag_leffler nonnegative relaxation_filter relaxation_spectrum springpot_pair)
set(TPM_core_OF_law contact_edge_force contact_geometry contact_history contact_history_load contact_retreat
    creep_weights depth_pieces drive_path frequency_response imposed_depth imposed_load kelvin_chain kept_step kernel
    kernel_tables law law_model operational_stiffness prony_table relaxation relaxation_sum stored_energy tension_creep)
set(TPM_haptics_OF_formulations loop_contacts reduced_contacts)
set(TPM_fit_OF_study material_function recording_setup selection selection_output selection_warnings)
set(TPM_organ_OF_library scene)
set(TPM_fit_OF_library fit)
set(TPM_haptics_OF_library session)

# What each links beside those of the components it stands on.
set(TPM_core_NEEDS)
set(TPM_core_LIBRARIES)
set(TPM_organ_NEEDS core)
set(TPM_organ_LIBRARIES tpm_sundials tpm_hdf5 tpm_muparser tpm_csv tpm_deflate tpm_minizip tpm_metis
    OpenSSL::Crypto Threads::Threads TBB::tbb ZLIB::ZLIB)
set(TPM_fit_NEEDS organ)
set(TPM_fit_LIBRARIES tpm_ceres)
set(TPM_haptics_NEEDS organ)
set(TPM_haptics_LIBRARIES tpm_httplib ${CMAKE_DL_LIBS})

# The targets of objects that a component is made of.
function(tpm_objects_of component list)
  set(objects)
  foreach(folder IN LISTS TPM_FOLDERS)
    set(targets tpm_folder_${folder}_of_${component})
    if(folder IN_LIST TPM_${component}_FOLDERS)
      list(APPEND targets tpm_folder_${folder})
    endif()
    foreach(target IN LISTS targets)
      if(TARGET ${target})
        list(APPEND objects $<TARGET_OBJECTS:${target}>)
      endif()
    endforeach()
  endforeach()
  set(${list} ${objects} PARENT_SCOPE)
endfunction()

# Archives libtpmkit_COMPONENT.a with their targets tpmkit::COMPONENT, each in an export of its own. The component organ
# has its own list of formulations, without those that only sessions step.
function(tpm_components)
  set(of_organ ${TPM_FORMULATION_SOURCES})
  foreach(source IN LISTS TPM_haptics_OF_formulations)
    list(REMOVE_ITEM of_organ ${PROJECT_SOURCE_DIR}/src/tpm/formulations/${source}.cpp)
  endforeach()
  tpm_formulation_list(${CMAKE_BINARY_DIR}/organ_formulation_list.cpp shipped_formulations ${of_organ})
  add_library(tpm_organ_formulation_list OBJECT ${CMAKE_BINARY_DIR}/organ_formulation_list.cpp
              ${CMAKE_BINARY_DIR}/formulations.cpp)
  tpm_folder_options(tpm_organ_formulation_list)
  foreach(component IN LISTS TPM_COMPONENTS)
    tpm_objects_of(${component} objects)
    if(component STREQUAL core)
      list(APPEND objects $<TARGET_OBJECTS:tpm_shape_list>)
    elseif(component STREQUAL organ)
      list(APPEND objects $<TARGET_OBJECTS:tpm_organ_formulation_list>)
    elseif(component STREQUAL haptics)
      list(APPEND objects $<TARGET_OBJECTS:tpm_formulation_list>)
    endif()
    set(target tpmkit_component_${component})
    add_library(${target} STATIC ${objects})
    # libtpmkit_haptics is the library of the C interface.
    set(name tpmkit_${component})
    if(component STREQUAL haptics)
      set(name tpmkit_haptics_cpp)
    endif()
    set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX OUTPUT_NAME ${name} EXPORT_NAME ${component})
    target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                                $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_compile_features(${target} INTERFACE cxx_std_20)
    target_link_libraries(${target} PUBLIC Eigen3::Eigen fmt::fmt)
    foreach(need IN LISTS TPM_${component}_NEEDS)
      target_link_libraries(${target} PUBLIC tpmkit_component_${need})
    endforeach()
    target_link_libraries(${target} PRIVATE ${TPM_${component}_LIBRARIES})
    install(TARGETS ${target} EXPORT tpmkit-${component}
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
    install(EXPORT tpmkit-${component} NAMESPACE tpmkit:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tpmkit
            COMPONENT development)
  endforeach()
endfunction()
