/// \file
/// Text as part of a file's name.
#pragma once

#include <string>

namespace decant {

/// Letters, digits and "._-" stay; everything else becomes a dash.
inline std::string plain_file_name(std::string text) {
  for (char& c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!letter && c != '.' && c != '_') c = '-';
  }
  return text;
}

}  // namespace decant
