/// \file
/// Fixtures as files; the layout is in formats/fixture.md.
#pragma once

#include "oracle/solution/fixture.hpp"

#include <cstdint>
#include <filesystem>

namespace decant {

/// Schema version of fixture files; a reader refuses any other.
inline constexpr std::int64_t fixture_schema = 2;

/// Throws InputError naming file, dataset and what is wrong: truncated, wrong version, missing
/// group, wrong shape, NaN or non-fp32 state, a scene that does not parse, walls sampled otherwise
/// than when the fixture was recorded.
Fixture read_fixture(const std::filesystem::path& file);

/// Writes aside, then renames. With `fields` everything is stored, without them the sample. Throws
/// std::runtime_error naming file and dataset where the fixture is one that read_fixture would
/// refuse, or where writing fails.
void write_fixture(const std::filesystem::path& file, const Fixture& fixture);

}  // namespace decant
