# cmake -DOUTPUT=file.inc "-DINPUTS=a.glsl;b.glsl" -P shaders_as_cpp.cmake
# Writes GLSL functions as C++ for GLM. The languages differ in literals, which are single precision in GLSL, and in
# swizzles, which are functions in GLM.
set(text "")
foreach(input ${INPUTS})
  file(READ ${input} source)
  string(REPLACE ";" "\\;" source "${source}")
  string(REGEX REPLACE "([0-9]+\\.[0-9]+(e-?[0-9]+)?|[0-9]+e-[0-9]+)" "\\1f" source "${source}")
  string(REGEX REPLACE "\\.([xyzw][xyzw]+|rgb)([^A-Za-z0-9_])" ".\\1()\\2" source "${source}")
  string(REPLACE "\\;" ";" source "${source}")
  string(APPEND text "${source}")
endforeach()
file(WRITE ${OUTPUT} "${text}")
