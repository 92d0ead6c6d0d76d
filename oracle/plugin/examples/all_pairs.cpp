// The solver of all_pairs.hpp as a plug-in. From the project's folder:
//   g++ -std=c++20 -O2 -fPIC -shared -I. -I/usr/include/eigen3 oracle/plugin/examples/all_pairs.cpp -o all_pairs.so
//   decant conform hostile-periodic --backend plugin:./all_pairs.so
#include "oracle/plugin/examples/all_pairs.hpp"
#include "oracle/plugin/examples/as_plugin.hpp"

const decant_plugin_table* decant_plugin(std::uint32_t) {
  static const decant_plugin_table table = PluginOf<AllPairs>::table("all-pairs");
  return &table;
}
