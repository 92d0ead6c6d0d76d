/* In C: offers nothing, which is a plug-in all the same. */
#include "oracle/plugin.h"

#include <stddef.h>

static int create(const char* options, void** solver) {
  (void)options;
  *solver = NULL;
  return 0;
}
static void destroy(void* solver) { (void)solver; }
static int load(void* solver, const decant_scene* scene, const decant_walls* walls, const decant_state* state) {
  (void)solver;
  return scene->size == sizeof *scene && walls->size == sizeof *walls && state->size == sizeof *state ? 0 : 1;
}
static const char* last_error(void* solver) {
  (void)solver;
  return "sizes differ";
}

const decant_plugin_table* decant_plugin(uint32_t host_abi) {
  static decant_plugin_table table;
  if (host_abi != DECANT_PLUGIN_ABI) return NULL;
  table.abi = DECANT_PLUGIN_ABI;
  table.size = sizeof table;
  table.name = "nothing";
  table.precision = "fp64";
  table.create = create;
  table.destroy = destroy;
  table.load = load;
  table.last_error = last_error;
  return &table;
}
