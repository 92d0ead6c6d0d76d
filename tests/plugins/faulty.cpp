// The example with a fault, by option: fault=NAME, and in which abilities it offers, offers=BITS. What is compiled
// with a macro differs in its table.
#include "oracle/plugin/examples/all_pairs.hpp"
#include "oracle/plugin/examples/as_plugin.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

const decant_plugin_table table = PluginOf<AllPairs>::table("all-pairs");
std::string fault;
decant_plugin_table faulty;

int create_with_fault(const char* options, void** solver) {
  const std::string text = options;
  if (text.rfind("fault=", 0) == 0) fault = text.substr(6);
  return table.create("", solver);
}

int evaluate_with_fault(void* solver, const decant_given* given, decant_fields* out, decant_status* status) {
  const int result = table.evaluate(solver, given, out, status);
  const double nan = std::nan("");
  if (fault == "nan") out->density[out->fluid / 2] = nan;
  if (fault == "unwritten") std::fill_n(out->pressure, out->fluid, nan);
  if (fault == "beyond") out->density[out->fluid] = 1000;
  if (fault == "before") out->fluid_neighbor_count[-1] = 0;
  if (fault == "wrong") out->acceleration[0] *= 1.01;
  if (fault == "echoes" && given) std::copy_n(given->pressure, out->fluid, out->pressure);
  if (fault == "throws") throw std::runtime_error("nobody catches this");
  return fault == "error" ? 1 : result;
}

int advance_with_fault(void* solver, std::int64_t substeps, decant_status* status) {
  if (fault == "crash") std::abort();
  if (fault == "leaves") std::_Exit(7);
  while (fault == "hangs") std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return table.advance(solver, fault == "short" ? substeps - 1 : substeps, status);
}

const char* error_with_fault(void*) { return fault == "error" ? "out of luck" : ""; }

}  // namespace

const decant_plugin_table* decant_plugin(std::uint32_t) {
  faulty = table;
  faulty.create = create_with_fault;
  faulty.evaluate = evaluate_with_fault;
  faulty.advance = advance_with_fault;
  faulty.last_error = error_with_fault;
#ifdef DECANT_TEST_OFFERS
  faulty.offers = DECANT_TEST_OFFERS;
#endif
#ifdef DECANT_TEST_ABI
  faulty.abi = DECANT_TEST_ABI;
#endif
#ifdef DECANT_TEST_SIZE
  // Beyond what such a table has is whatever lies there.
  std::memset(reinterpret_cast<char*>(&faulty) + DECANT_TEST_SIZE, 0x5a, sizeof faulty - DECANT_TEST_SIZE);
  faulty.size = DECANT_TEST_SIZE;
#endif
#ifdef DECANT_TEST_NO_READ
  faulty.read = nullptr;
#endif
  return &faulty;
}
