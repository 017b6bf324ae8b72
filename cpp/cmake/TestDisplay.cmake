# What tests in windows run under (`display`), and the folder that they write to (`output`). With xvfb-run each test gets a display
# of its own; -noreset keeps it when a test closes its last window.
find_program(XVFB_RUN xvfb-run)
set(display)
if (XVFB_RUN)
  set(display "${XVFB_RUN}" -a -s "-screen 0 1280x1024x24 -noreset")
endif ()
set(output "${CMAKE_CURRENT_BINARY_DIR}/output")
file(MAKE_DIRECTORY "${output}")
