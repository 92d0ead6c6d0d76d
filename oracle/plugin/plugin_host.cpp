/// \file
/// The process of a plug-in that is a library: opens it, checks its table, and does what is asked over socket 3.
///   decant-plugin-host LIBRARY OPTIONS
#include "oracle/plugin.h"
#include "oracle/plugin/serve.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>

namespace decant {
namespace {

constexpr int socket_fd = 3;

[[noreturn]] void fail(const std::string& why) { throw std::runtime_error(why); }

/// A plug-in's table as far as both know it, the rest null. Throws where it is none of ours.
decant_plugin_table table_of(const std::string& library) {
  void* handle = ::dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) fail(fmt::format("is no library that can be loaded: {}", ::dlerror()));
  const auto entry = reinterpret_cast<decltype(&decant_plugin)>(::dlsym(handle, "decant_plugin"));
  if (!entry) fail("exports no function decant_plugin (oracle/plugin.h)");
  const decant_plugin_table* given = entry(DECANT_PLUGIN_ABI);
  if (!given) fail(fmt::format("does not work with ABI {}", DECANT_PLUGIN_ABI));
  if (given->abi != DECANT_PLUGIN_ABI)
    fail(fmt::format("is built for ABI {}; this program has {}", given->abi, DECANT_PLUGIN_ABI));
  decant_plugin_table table{};
  constexpr std::uint32_t least = offsetof(decant_plugin_table, device);
  if (given->size < least) fail(fmt::format("has a table of {} bytes; at least {} are needed", given->size, least));
  std::memcpy(&table, given, std::min<std::size_t>(given->size, sizeof table));
  const auto need = [&](bool there, const char* what) {
    if (!there) fail(fmt::format("has no {}", what));
  };
  need(table.name && *table.name, "name");
  need(table.create && table.destroy && table.load && table.last_error, "create, destroy, load or last_error");
  constexpr std::uint32_t fields = DECANT_OFFERS_DENSITY | DECANT_OFFERS_ACCELERATION | DECANT_OFFERS_PARTS |
                                   DECANT_OFFERS_NEIGHBORS | DECANT_OFFERS_GIVEN | DECANT_OFFERS_BOUNDARY_VOLUME;
  need(!(table.offers & fields) || table.evaluate, "evaluate, which its offers need");
  need(!(table.offers & DECANT_OFFERS_STEP) || (table.advance && table.read), "advance or read, which its offers need");
  need(!(table.offers & DECANT_OFFERS_LISTS) || table.lists, "lists, which its offers need");
  return table;
}

OpenPlugin opened(const std::string& library, const std::string& options) {
  OpenPlugin plugin{table_of(library), nullptr};
  const int status = plugin.table.create(options.c_str(), &plugin.solver);
  if (status == 0) return plugin;
  const char* why = plugin.table.last_error(plugin.solver);
  fail(why && *why ? why : fmt::format("create failed with {}", status));
}

}  // namespace
}  // namespace decant

int main(int count, char** arguments) {
  if (count != 3) return 2;
  decant::serve_plugin(decant::socket_fd, [&] { return decant::opened(arguments[1], arguments[2]); });
  return 0;
}
