/// \file
/// Files as bytes of the program. The assembler takes them in: as an array in C++ a megabyte takes a compiler minutes.
#include "tools/live/page.hpp"

#define DECANT_PAGE_FILE(symbol, path)                                                                \
  asm(".pushsection .rodata\n.hidden decant_page_" #symbol "\n.hidden decant_page_" #symbol           \
      "_end\n.global decant_page_" #symbol "\ndecant_page_" #symbol ":\n.incbin \"" path              \
      "\"\n.global decant_page_" #symbol "_end\ndecant_page_" #symbol "_end:\n.byte 0\n.popsection"); \
  extern "C" const char decant_page_##symbol[], decant_page_##symbol##_end[]

DECANT_PAGE_FILE(index, DECANT_PAGE "/index.html");
DECANT_PAGE_FILE(style, DECANT_PAGE "/live.css");
DECANT_PAGE_FILE(live, DECANT_PAGE "/live.js");
DECANT_PAGE_FILE(view, DECANT_PAGE "/view.js");
DECANT_PAGE_FILE(curves, DECANT_PAGE "/curves.js");
DECANT_PAGE_FILE(history, DECANT_PAGE "/history.js");
DECANT_PAGE_FILE(licenses, DECANT_PAGE "/licenses.txt");
DECANT_PAGE_FILE(three, DECANT_THREE);
DECANT_PAGE_FILE(orbit, DECANT_ORBIT_CONTROLS);
DECANT_PAGE_FILE(chart, DECANT_CHART);

namespace decant::live {

const std::vector<PageFile>& page_files() {
  const auto bytes = [](const char* begin, const char* end) {
    return std::string_view(begin, static_cast<std::size_t>(end - begin));
  };
#define DECANT_BYTES(symbol) bytes(decant_page_##symbol, decant_page_##symbol##_end)
  static const std::vector<PageFile> files = {
      {"", "text/html; charset=utf-8", DECANT_BYTES(index)},
      {"live.css", "text/css; charset=utf-8", DECANT_BYTES(style)},
      {"live.js", "text/javascript; charset=utf-8", DECANT_BYTES(live)},
      {"view.js", "text/javascript; charset=utf-8", DECANT_BYTES(view)},
      {"curves.js", "text/javascript; charset=utf-8", DECANT_BYTES(curves)},
      {"history.js", "text/javascript; charset=utf-8", DECANT_BYTES(history)},
      {"licenses.txt", "text/plain; charset=utf-8", DECANT_BYTES(licenses)},
      {"three.js", "text/javascript; charset=utf-8", DECANT_BYTES(three)},
      {"orbit-controls.js", "text/javascript; charset=utf-8", DECANT_BYTES(orbit)},
      {"chart.js", "text/javascript; charset=utf-8", DECANT_BYTES(chart)}};
#undef DECANT_BYTES
  return files;
}

}  // namespace decant::live
