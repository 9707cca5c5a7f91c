# cmake --install and CPack: the program with its presets, models, scenes, manual page and completions ("program"), and the
# libraries with their headers ("development").
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(DATA ${CMAKE_INSTALL_DATADIR}/offstage)
set(CONFIG ${CMAKE_INSTALL_LIBDIR}/cmake/offstage)

install(TARGETS offstage RUNTIME COMPONENT program)
install(DIRECTORY effects/presets/ DESTINATION ${DATA}/presets COMPONENT program FILES_MATCHING PATTERN *.json)
install(DIRECTORY assets/models assets/pictures DESTINATION ${DATA}/assets COMPONENT program)
install(DIRECTORY demos/scenes DESTINATION ${DATA}/demos COMPONENT program)  # they name models as ../../assets/models/...
install(FILES LICENSE assets/CREDITS.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

# The program itself prints the manual page and the completions.
install(CODE "
  function(written command file)
    execute_process(COMMAND \"$<TARGET_FILE:offstage>\" \${command} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
    file(WRITE \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/\${file}\" \"\${text}\")
    message(STATUS \"Installing: \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/\${file}\")
  endfunction()
  written(schema ${DATA}/scene.schema.json)
  written(man ${CMAKE_INSTALL_MANDIR}/man1/offstage.1)
  written(\"completion;bash\" ${CMAKE_INSTALL_DATADIR}/bash-completion/completions/offstage)
  written(\"completion;zsh\" ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions/_offstage)
  written(\"completion;fish\" ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d/offstage.fish)"
  COMPONENT program)

install(TARGETS offstage_sim offstage_effects offstage_render offstage_producer glad offstage_abi EXPORT offstageTargets
  ARCHIVE COMPONENT development)
install(EXPORT offstageTargets NAMESPACE offstage:: DESTINATION ${CONFIG} COMPONENT development)
foreach(folder sim effects render demos/producer)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/${folder} ${PROJECT_SOURCE_DIR}/${folder}/*.h)
  get_filename_component(name ${folder} NAME)
  foreach(header IN LISTS headers)
    file(STRINGS ${PROJECT_SOURCE_DIR}/${folder}/${header} private REGEX "Private" LIMIT_COUNT 1)
    get_filename_component(place ${name}/${header} DIRECTORY)
    if(NOT private)
      install(FILES ${folder}/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/offstage/${place} COMPONENT development)
    endif()
  endforeach()
endforeach()
configure_package_config_file(cmake/offstageConfig.cmake.in ${PROJECT_BINARY_DIR}/offstageConfig.cmake INSTALL_DESTINATION ${CONFIG})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/offstageConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/offstageConfig.cmake ${PROJECT_BINARY_DIR}/offstageConfigVersion.cmake
  DESTINATION ${CONFIG} COMPONENT development)

# cpack -G DEB in the build folder: offstage_*.deb and offstage-dev_*.deb.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME offstage)
set(CPACK_PACKAGE_CONTACT "the authors of offstage <offstage@invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "films of physically simulated scenes, without a display or a GPU")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME offstage)
# The program loads these libraries at run time, so dpkg-shlibdeps does not find them.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "libosmesa6 | libegl1, libosmesa6 | libgl1-mesa-dri")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS ffmpeg)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME offstage-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "pkg-config, libeigen3-dev, libtbb-dev, libembree-dev, libassimp-dev, libdeflate-dev, libopenexr-dev, libqhull-dev, libxxhash-dev, libzstd-dev, \
libfmt-dev, nlohmann-json3-dev, libdraco-dev, libmeshoptimizer-dev, libwebp-dev")
include(CPack)
