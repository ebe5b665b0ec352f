# What the committed completions offer, in the shells that are installed; zsh and fish only read theirs.
cmake_policy(SET CMP0054 NEW)
find_program(BASH bash)
find_program(ZSH zsh)
find_program(FISH fish)

function(offers line wanted) # the words of a line, the last to be completed; a word that must be offered
  file(WRITE ${WORK}/ask.bash "source ${ROOT}/tools/completions/quadwright.bash
COMP_WORDS=(${line} \"$1\")
COMP_CWORD=$((\${#COMP_WORDS[@]} - 1))
_quadwright
printf '%s\\n' \"\${COMPREPLY[@]}\"
")
  execute_process(COMMAND ${BASH} --norc ${WORK}/ask.bash ${ARGN} OUTPUT_VARIABLE said RESULT_VARIABLE code)
  if(NOT code EQUAL 0 OR NOT "\n${said}" MATCHES "\n${wanted}\n")
    message(FATAL_ERROR "bash: \"${line} ${ARGN}\" offers\n${said}and not ${wanted}")
  endif()
endfunction()

set(tried "")
if(BASH)
  offers("quadwright" "measure" m)
  offers("quadwright in.obj" "--edge-length" --edge)
  offers("quadwright in.obj" "--no-relax" --no-r)
  offers("quadwright in.obj --preset" "character" c)
  offers("quadwright in.obj --symmetry" "auto" a)
  offers("quadwright in.obj --preset =" "character" c)
  offers("quadwright in.obj --preset" "character" =)
  offers("quadwright help" "symmetry" sym)
  offers("quadwright help" "cad" ca)
  file(WRITE ${WORK}/ask.bash "source ${ROOT}/tools/completions/quadwright.bash
cd ${ROOT}
COMP_WORDS=(quadwright in.obj --preset \"\"); COMP_CWORD=3; _quadwright; printf '%s\\n' \"\${COMPREPLY[@]}\"
COMP_WORDS=(quadwright in.obj --sharp \"\"); COMP_CWORD=3; _quadwright; printf '%s\\n' \"\${COMPREPLY[@]}\"
COMP_WORDS=(quadwright in.obj --); COMP_CWORD=2; _quadwright; printf '%s\\n' \"\${COMPREPLY[@]}\" | sort | uniq -d
")
  execute_process(COMMAND ${BASH} --norc ${WORK}/ask.bash OUTPUT_VARIABLE said)
  if(NOT said MATCHES "soup\n" OR said MATCHES "README.md|ANGLE|--")
    message(FATAL_ERROR "bash: files, a value's name or a word twice are offered:\n${said}")
  endif()
  list(APPEND tried bash)
endif()
foreach(pair "ZSH;_quadwright" "FISH;quadwright.fish")
  list(GET pair 0 shell)
  list(GET pair 1 script)
  if(${shell})
    execute_process(COMMAND ${${shell}} -n ${ROOT}/tools/completions/${script} ERROR_VARIABLE said RESULT_VARIABLE code)
    if(NOT code EQUAL 0)
      message(FATAL_ERROR "${script}: ${said}")
    endif()
    list(APPEND tried ${shell})
  endif()
endforeach()
# Descriptions are cut after their first clause, but not within a bracket.
foreach(script "_quadwright" "quadwright.fish")
  file(STRINGS ${ROOT}/tools/completions/${script} cut REGEX "(-d '|\\[)[^']*\\([^)]*$")
  if(cut)
    message(FATAL_ERROR "${script}: a bracket is cut through: ${cut}")
  endif()
endforeach()
message(STATUS "tried in: ${tried}")
