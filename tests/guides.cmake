# Runs every command of docs/guides, in their order, on surfaces of quadwright-shapes; each must succeed, and make the picture that its page shows. COPY: the pictures go
# to docs/guides/pictures (make guide-pictures).
find_program(AWK awk REQUIRED)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/models)
foreach(row "dancer;8000;character" "bracket;3500;part" "hand;9000;hand" "sheet;4000;garment" "star;6000;star" "head;40000;head" "bracket;1200;models/a" "knot;1200;models/b")
  list(GET row 0 shape)
  list(GET row 1 faces)
  list(GET row 2 name)
  execute_process(COMMAND ${SHAPES} ${shape} ${faces} ${WORK}/${name}.obj RESULT_VARIABLE code)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "quadwright-shapes ${shape}")
  endif()
endforeach()
execute_process(COMMAND ${SHAPES} head 40000 ${WORK}/head.glb RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "quadwright-shapes head.glb")
endif()
# A scan: noise of a hundredth of the size of a hand, and a fragment. Loops around the mouth and an eye of the head: of each direction the vertex of the face that is nearest to an
# oval.
execute_process(COMMAND ${AWK} "/^v / { n++; for (i = 2; i <= 4; i++) { r = sin(n * 12.9898 + i * 78.233) * 43758.5453; $i += 0.006 * (r - int(r)) }
    if (n == 1) { x = $2 + 0.1; y = $3; z = $4 } } { print }
  END { print \"v\", x, y, z; print \"v\", x + 0.01, y, z; print \"v\", x, y + 0.01, z; print \"v\", x, y, z + 0.01
    print \"f -4 -2 -3\\nf -4 -3 -1\\nf -4 -1 -2\\nf -3 -2 -1\" }" ${WORK}/hand.obj
  OUTPUT_FILE ${WORK}/scan.obj RESULT_VARIABLE code)
execute_process(COMMAND ${AWK} "BEGIN { n = split(\"0 -0.285 0.18 0.11 0.17 0.09 0.135 0.095\", oval, \" \") }
  /^v / && $4 > 0 { x[++front] = $2; y[front] = $3; z[front] = $4 }
  END { for (i = 1; i < n; i += 4) { first = made + 1; line = \"l\"
      for (k = 0; k < 12; k++) { a = oval[i] + oval[i + 2] * cos(k * 0.5235988); b = oval[i + 1] + oval[i + 3] * sin(k * 0.5235988); least = 100
        for (v = 1; v <= front; v++) { d = (x[v] - a) ^ 2 + (y[v] - b) ^ 2; if (d < least) { least = d; at = v } }
        print \"v\", x[at], y[at], z[at]; line = line \" \" (++made) }
      print \"g rings 3\"; print line, first } }" ${WORK}/head.obj
  OUTPUT_FILE ${WORK}/loops.obj RESULT_VARIABLE more)
if(NOT code EQUAL 0 OR NOT more EQUAL 0)
  message(FATAL_ERROR "awk: ${code} ${more}")
endif()

# A soup: two parts that cross. A generated mesh: the figure with colours.
execute_process(COMMAND ${AWK} "FNR == 1 { before = n; file++ } /^v / { n++; print (file == 2 ? \"v \" 0.5 * $2 + 4.5 \" \" 0.5 * $3 + 3.2 \" \" 0.5 * $4 + 0.8 : $0); next }
  /^f / { print \"f\", $2 + before, $3 + before, $4 + before }" ${WORK}/models/a.obj ${WORK}/models/b.obj OUTPUT_FILE ${WORK}/soup.obj RESULT_VARIABLE code)
execute_process(COMMAND ${AWK} "/^v / { print $0, ($2 > 0 ? 0.9 : 0.2), 0.5, ($4 > 0 ? 0.8 : 0.3); next } { print }" ${WORK}/character.obj
  OUTPUT_FILE ${WORK}/generated.obj RESULT_VARIABLE more)
if(NOT code EQUAL 0 OR NOT more EQUAL 0)
  message(FATAL_ERROR "awk: ${code} ${more}")
endif()

# The figure in two materials. Densities that rise across the garment, to 2 and to 4. Points of the hand.
foreach(row "dressed.obj;character.obj;/^v / { x[++n] = $2 + 0.6 * $3 } /^f / { m = x[$2 + 0] + x[$3 + 0] + x[$4 + 0] > 0.9 ? \"cloth\" : \"skin\" SEP if (m != last) print \"usemtl\", last = m } { print }"
    "density-2.txt;garment.obj;/^v / { print 1 + ($2 > 3.5 ? 1 : 0) }" "density-4.txt;garment.obj;/^v / { print 1 + ($2 > 3.5 ? 3 : 0) }"
    "points.xyz;hand.obj;/^v / { print $2, $3, $4 }")
  list(GET row 0 name)
  list(GET row 1 from)
  list(GET row 2 program)
  string(REPLACE " SEP " "\n" program "${program}")
  execute_process(COMMAND ${AWK} "${program}" ${WORK}/${from} OUTPUT_FILE ${WORK}/${name} RESULT_VARIABLE code)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "awk for ${name}: ${code}")
  endif()
endforeach()

file(GLOB pages ${ROOT}/docs/guides/*.md)
set(count 0)
foreach(page ${pages})
  file(STRINGS ${page} lines)
  foreach(line IN LISTS lines)
    if(line MATCHES "^    quadwright (.*)$")
      separate_arguments(arguments UNIX_COMMAND "${CMAKE_MATCH_1}")
      execute_process(COMMAND ${TOOL} ${arguments} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE code OUTPUT_VARIABLE said ERROR_VARIABLE said)
      if(NOT code EQUAL 0)
        message(FATAL_ERROR "${page}: ${line}\n${said}")
      endif()
      math(EXPR count "${count} + 1")
    elseif(line MATCHES "^!.*]\\(pictures/([a-z-]+\\.png)")
      list(APPEND pictures ${CMAKE_MATCH_1})
    endif()
  endforeach()
endforeach()
if(count LESS 20)
  message(FATAL_ERROR "docs/guides has ${count} commands only")
endif()
foreach(picture ${pictures})
  if(NOT EXISTS ${WORK}/${picture})
    message(FATAL_ERROR "no command of docs/guides makes ${picture}")
  endif()
  if(COPY)
    file(COPY ${WORK}/${picture} DESTINATION ${ROOT}/docs/guides/pictures)
  endif()
endforeach()
