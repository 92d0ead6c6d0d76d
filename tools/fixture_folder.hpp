/// \file
/// Where recorded fixtures are found without being named.
#pragma once

#include <filesystem>
#include <vector>

namespace decant {

/// The folder DECANT_FIXTURES names; else share/decant/fixtures beside the installed binary's
/// folder; else the nearest `fixtures` folder with recordings above the binary. Throws InputError
/// where there is none.
std::filesystem::path fixture_folder();

/// The recordings in a folder, by name: those that are not of study scale, or all. Throws InputError where
/// there is none.
std::vector<std::filesystem::path> fixtures_in(const std::filesystem::path& folder, bool all);

}  // namespace decant
