/// \file
/// The files of the page, in the program itself: nothing is looked for at run time. three.js (WebGL, orbit controls) and
/// Chart.js (curves) come from the distribution's packages when Decant is built.
#pragma once

#include <string_view>
#include <vector>

namespace decant::live {

struct PageFile {
  std::string_view name, type, bytes;  // the page itself has no name
};

const std::vector<PageFile>& page_files();

}  // namespace decant::live
