# decant_precompile(TARGET HEADER…): headers that most sources of a target include are read once. A source still
# includes what it uses: presets other than release and host build without.
function(decant_precompile TARGET)
  list(TRANSFORM ARGN REPLACE "^(.+)$" "$<$<COMPILE_LANGUAGE:CXX>:<\\1$<ANGLE-R>>" OUTPUT_VARIABLE headers)
  target_precompile_headers(${TARGET} PRIVATE ${headers})
  # ccache asks for it.
  target_compile_options(${TARGET} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fpch-preprocess>)
endfunction()
