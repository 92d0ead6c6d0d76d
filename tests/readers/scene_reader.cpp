/// \file
/// Bytes as a scene: refused with file, key and bound, or taken, and then they come back from their
/// canonical form as they were.
#include "reference/scene_file.hpp"
#include "tests/readers/expect.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace decant;
  const std::string text(reinterpret_cast<const char*>(data), size);
  Scene scene;
  if (!readers::taken([&] { scene = complete_scene(text, "scene.json"); })) return 0;
  const std::string canonical = scene_to_json(scene);
  Scene again;
  if (!readers::taken([&] { again = parse_scene(canonical, "canonical.json"); }))
    readers::give_up("the canonical form of a scene is refused");
  if (scene_to_json(again) != canonical) readers::give_up("another scene came back");
  return 0;
}
