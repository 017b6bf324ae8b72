# Which Python has a VTK, and where it looks for packages.

# halite_python_of_vtk(FOUND PROBLEM VERSION WHERE CANDIDATE...): the first of the interpreters whose VTK is of that version, or
# what they have instead. WHERE is where the VTK that is built with was found.
function (halite_python_of_vtk found problem version where)
  set(${found} "" PARENT_SCOPE)
  set(others)
  set(candidates ${ARGN})
  list(REMOVE_DUPLICATES candidates)
  foreach (candidate IN LISTS candidates)
    if (EXISTS "${candidate}")
      execute_process(COMMAND "${candidate}" -c
          "from vtkmodules.vtkCommonCore import vtkVersion; print(vtkVersion.GetVTKVersion())"
        OUTPUT_VARIABLE has OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
      if (has STREQUAL version)
        set(${found} "${candidate}" PARENT_SCOPE)
        return ()
      endif ()
      if (has)
        list(APPEND others "${candidate} has VTK ${has}")
      else ()
        list(APPEND others "${candidate} has no VTK")
      endif ()
    else ()
      list(APPEND others "there is no ${candidate}")
    endif ()
  endforeach ()
  list(JOIN others ", " others)
  set(${problem} "No Python with VTK ${version}, which was found in ${where}: ${others}. Install VTK ${version} for one of them, say \
-DPython3_EXECUTABLE=… of another, or -DVTK_DIR=… of the VTK that Python has, or -DHALITE_PYTHON=OFF" PARENT_SCOPE)
endfunction ()

# halite_python_destination(DESTINATION IS_FOUND PYTHON PREFIX): where below a prefix that Python looks for packages, such as
# lib/python3.11/dist-packages; empty, and not found, if nowhere.
function (halite_python_destination destination is_found python prefix)
  set(ask [[
import os, site, sys
prefix = os.path.realpath(sys.argv[1])
places = (site.getsitepackages() if hasattr(site, "getsitepackages") else []) + sys.path
# What lies directly in the prefix's lib: not in a prefix of its own below, as /usr/local is below /usr.
below = [os.path.relpath(p, prefix) for p in map(os.path.realpath, places) if p.endswith("-packages")]
print(next((p for p in below if p.split(os.sep)[0] in ("lib", "lib64", "Lib")), ""))
]])
  execute_process(COMMAND "${python}" -c "${ask}" "${prefix}"
    OUTPUT_VARIABLE below OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  string(REPLACE "\\" "/" below "${below}")
  set(${destination} "${below}" PARENT_SCOPE)
  if (below)
    set(${is_found} TRUE PARENT_SCOPE)
  else ()
    set(${is_found} FALSE PARENT_SCOPE)
  endif ()
endfunction ()
