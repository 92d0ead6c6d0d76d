/// \file
/// Bytes as a fixture: refused with file, key and bound, or taken. Half of the inputs come from edits of
/// whole objects, for bytes that change at random rarely get past HDF5.
#include "oracle/files/fixture_file.hpp"
#include "oracle/solution/fixture.hpp"
#include "tests/readers/expect.hpp"
#include "tests/readers/fixture_edits.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace decant::readers;
  const ScratchFile file(std::string_view(reinterpret_cast<const char*>(data), size));
  taken([&] { (void)decant::read_fixture(file.path()); });
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  using namespace decant::readers;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (seed % 2 == 0) return LLVMFuzzerMutate(data, size, most);
  const std::string edited = edited_fixture(bytes, seed / 2);
  if (edited.empty() || edited.size() > most) return LLVMFuzzerMutate(data, size, most);
  std::memcpy(data, edited.data(), edited.size());
  return edited.size();
}
