# The library takes no function from the C library whose last bit differs between platforms: of its mathematics only what is exact.
# cmake -DNM=... -DLIBRARY=libquadwright.a -P elementary.cmake
execute_process(COMMAND ${NM} -u ${LIBRARY} OUTPUT_VARIABLE symbols RESULT_VARIABLE code ERROR_QUIET)
if(code)
  message(FATAL_ERROR "${NM} cannot read ${LIBRARY}")
endif()
set(inexact sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh sincos exp exp2 exp10 expm1 log log2 log10 log1p pow cbrt hypot
  erf erfc tgamma lgamma fma fmod remainder rint nearbyint lrint llrint lround llround round)
foreach(name IN LISTS inexact)
  if(symbols MATCHES "[ \n]U +(${name}[fl]?)\n")
    message(SEND_ERROR "the library calls ${CMAKE_MATCH_1}: base/elementary.h has one with the same bits everywhere")
  endif()
endforeach()
if(NOT symbols MATCHES " U +malloc\n" AND NOT symbols MATCHES " U +realloc\n")
  message(FATAL_ERROR "no symbols were read from ${LIBRARY}")
endif()
