/// \file
/// Files that another program wrote with its library's defaults: h5py's are HDF5's older format, whose headers carry no
/// checksums, with strings of variable length. HDF5 1.10 reads damaged ones beyond what it holds, or for ever, so a
/// process that may crash reads them and writes what they hold anew, in the format that is read here.
#pragma once

#include "oracle/files/hdf5_io.hpp"

#include <chrono>
#include <filesystem>

namespace decant {

/// Opens such a file, rewritten where it has to be: groups three deep, numbers, and attributes of one value. Messages
/// name the file itself. Throws InputError as Hdf5Reader does, and where the process that rewrites is ended by a signal
/// or needs longer than `limit`.
Hdf5Reader open_foreign(const std::filesystem::path& file, std::chrono::milliseconds limit = std::chrono::minutes(1));

}  // namespace decant
