# Compiles the libraries a second time with AddressSanitizer and UndefinedBehaviorSanitizer, and links test programs with them
# (OFFSTAGE_SANITIZED_TESTS). The tests themselves are compiled once: both programs use the same object files.

# Checks memory errors and integer arithmetic. The checks of -fsanitize=undefined for null, misaligned and wrongly typed pointers are
# omitted: they take twice the compile time of all other checks, and AddressSanitizer or the processor finds most of these errors.
set(OFFSTAGE_SANITIZERS
  -fsanitize=address,signed-integer-overflow,shift,bounds,integer-divide-by-zero,float-cast-overflow,return,unreachable,bool,enum
  -fno-sanitize-recover=all -fno-omit-frame-pointer)
# GCC compiles a fifth faster when the checks are function calls instead of inline code.
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  list(APPEND OFFSTAGE_SANITIZERS "SHELL:--param asan-instrumentation-with-call-threshold=0")
endif()

# sanitized_names(OUT LIBRARIES...): the libraries of this project in LIBRARIES replaced by their sanitized twins.
function(sanitized_names out)
  set(names)
  foreach(library IN LISTS ARGN)
    if(library MATCHES "^offstage::(sim|effects|render|producer|engine|tune)$")
      set(library offstage_${CMAKE_MATCH_1}_sanitized)
    endif()
    list(APPEND names ${library})
  endforeach()
  set(${out} ${names} PARENT_SCOPE)
endfunction()

# offstage_sanitized_library(TARGET): defines TARGET_sanitized from the same sources. It is called at the end of the folder of TARGET.
function(offstage_sanitized_library target)
  if(NOT OFFSTAGE_SANITIZED_TESTS)
    return()
  endif()
  foreach(property SOURCES LINK_LIBRARIES INCLUDE_DIRECTORIES INTERFACE_INCLUDE_DIRECTORIES UNITY_BUILD UNITY_BUILD_MODE)
    get_target_property(${property} ${target} ${property})
    if(NOT ${property})
      set(${property})
    endif()
  endforeach()
  set(twin ${target}_sanitized)
  add_library(${twin} STATIC EXCLUDE_FROM_ALL ${SOURCES})
  sanitized_names(libraries ${LINK_LIBRARIES})
  target_link_libraries(${twin} PUBLIC ${libraries})
  target_include_directories(${twin} PRIVATE ${INCLUDE_DIRECTORIES} INTERFACE ${INTERFACE_INCLUDE_DIRECTORIES})
  target_compile_options(${twin} PRIVATE -O1 -g1 -UNDEBUG -w ${OFFSTAGE_SANITIZERS})
  target_precompile_headers(${twin} REUSE_FROM offstage_precompiled_sanitized)
  if(UNITY_BUILD)
    set_target_properties(${twin} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE ${UNITY_BUILD_MODE})
  endif()
endfunction()

# offstage_link_sanitized(TARGET LIBRARIES...): links the sanitized twins of LIBRARIES. They come first on the
# command line, so that the linker takes their instances of the templates that the target and the libraries share.
function(offstage_link_sanitized target)
  sanitized_names(libraries ${ARGN})
  target_link_libraries(${target} PRIVATE ${libraries})
  target_link_options(${target} PRIVATE ${OFFSTAGE_SANITIZERS})
  foreach(library IN LISTS libraries)
    if(library MATCHES "_sanitized$")
      target_link_options(${target} PRIVATE LINKER:--whole-archive $<TARGET_FILE:${library}> LINKER:--no-whole-archive)
    endif()
  endforeach()
endfunction()

# offstage_sanitized_tests(NAME SHARDS FILTER): links test_NAME_sanitized from the objects of test_NAME and runs it in SHARDS processes,
# because starting a process costs more than most tests. Property tests run an eighth of their cases here, and only every fourth
# model of the corpus is read. AddressSanitizer keeps 16 MB of freed memory from being used again, instead of 256 MB: with more,
# page faults take half the time of the tests of input files.
function(offstage_sanitized_tests name shards filter)
  if(NOT OFFSTAGE_SANITIZED_TESTS)
    return()
  endif()
  get_target_property(LINK_LIBRARIES test_${name} LINK_LIBRARIES)
  set(twin test_${name}_sanitized)
  add_executable(${twin} $<TARGET_OBJECTS:test_${name}>)
  set_target_properties(${twin} PROPERTIES LINKER_LANGUAGE CXX)
  offstage_link_sanitized(${twin} ${LINK_LIBRARIES})
  math(EXPR last "${shards} - 1")
  foreach(shard RANGE ${last})
    math(EXPR number "${shard} + 1")
    add_test(NAME sanitized.${name}.${number}_of_${shards} COMMAND ${twin} --gtest_filter=${filter})
    set_tests_properties(sanitized.${name}.${number}_of_${shards} PROPERTIES LABELS sanitized TIMEOUT 600 COST 100
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${shards};GTEST_SHARD_INDEX=${shard};ASAN_OPTIONS=quarantine_size_mb=16;UBSAN_OPTIONS=print_stacktrace=1;LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/lsan.supp:print_suppressions=0;RC_PARAMS=seed=20260101 max_success=50;OFFSTAGE_CORPUS_STEP=4")
  endforeach()
endfunction()

if(OFFSTAGE_SANITIZED_TESTS)
  add_library(offstage_precompiled_sanitized OBJECT ${CMAKE_CURRENT_BINARY_DIR}/precompiled.cpp)
  target_link_libraries(offstage_precompiled_sanitized PRIVATE Eigen3::Eigen offstage_flags)
  target_compile_options(offstage_precompiled_sanitized PRIVATE -O1 -g1 -UNDEBUG -w ${OFFSTAGE_SANITIZERS})
  get_target_property(headers offstage_precompiled_fast PRECOMPILE_HEADERS)
  target_precompile_headers(offstage_precompiled_sanitized PRIVATE ${headers})
endif()
