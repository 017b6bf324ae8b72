# halite_cargo_target_dir(FOLDER CARGO SOURCE): where cargo builds, by its environment and its configuration.
function (halite_cargo_target_dir folder cargo source)
  execute_process(COMMAND "${cargo}" metadata --no-deps --format-version 1
    WORKING_DIRECTORY "${source}" RESULT_VARIABLE failed OUTPUT_VARIABLE metadata ERROR_VARIABLE why)
  if (failed OR NOT metadata MATCHES "\"target_directory\":\"([^\"]+)\"")
    message(FATAL_ERROR "cargo does not say where it builds: ${why}")
  endif ()
  string(REPLACE "\\\\" "/" found "${CMAKE_MATCH_1}")
  set(${folder} "${found}" PARENT_SCOPE)
endfunction ()
