/// \file
/// Where recorded fixtures are found without being named.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace decant {

/// The folder DECANT_FIXTURES names; else share/decant/fixtures beside the installed binary's
/// folder; else the nearest `fixtures` folder with recordings above the binary. Throws InputError
/// where there is none.
std::filesystem::path fixture_folder();

/// The recordings in a folder, by name: those that are not of study scale, or all. Throws InputError where
/// there is none.
std::vector<std::filesystem::path> fixtures_in(const std::filesystem::path& folder, bool all);

/// A recording as it is given on the command line: a file, or the name of one in fixture_folder(). A name that is
/// neither comes back as it is.
std::filesystem::path recording_called(const std::string& given);

}  // namespace decant
