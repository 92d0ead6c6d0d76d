/// \file
/// Every committed recording and result says which revision made it, one that everybody can get.
#include "oracle/files/hdf5_io.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace decant {
namespace {

namespace fs = std::filesystem;

/// Files under fixtures/ with this ending.
std::vector<fs::path> committed(const std::string& extension) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(DECANT_SOURCE_DIR "/fixtures"))
    if (entry.path().extension() == extension) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// The abbreviated name of a commit and nothing else: no "-dirty", no "unknown".
bool is_revision(const std::string& text) {
  return text.size() >= 7 && text.size() <= 40 && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return std::isdigit(c) || (c >= 'a' && c <= 'f');
         });
}

TEST(Provenance, OfEveryCommittedHdf5FileIsARevision) {
  const auto files = committed(".h5");
  EXPECT_GT(files.size(), 30u);
  for (const auto& file : files) {
    const Hdf5Reader in(file);
    ASSERT_TRUE(in.has("/provenance") && in.has_attribute("/provenance", "git_revision")) << file;
    const std::string revision = in.text_attribute("/provenance", "git_revision");
    EXPECT_TRUE(is_revision(revision)) << file << ": " << revision;
  }
}

TEST(Provenance, OfEveryCommittedResultInJsonIsARevision) {
  int results = 0;
  for (const auto& file : committed(".json")) {
    if (file.string().find("/results/") == std::string::npos) continue;
    ++results;
    const auto json = nlohmann::json::parse(std::ifstream(file));
    ASSERT_TRUE(json.is_object() && json.contains("provenance")) << file;
    const auto revision = json.at("provenance").at("git_revision").get<std::string>();
    EXPECT_TRUE(is_revision(revision)) << file << ": " << revision;
  }
  EXPECT_GT(results, 5);
}

TEST(Provenance, OfCommittedTextsNamesNoFolderOfAMachine) {
  const std::regex folder("(^|[^A-Za-z0-9_.])/(home|mnt|opt|root|srv|tmp|work)/");
  EXPECT_TRUE(std::regex_search("/home/someone/decant/tests/a.cpp:3: Skipped", folder));
  EXPECT_FALSE(std::regex_search("tests/a.cpp:3: Skipped, km/h, fixtures/results/h200/work/", folder));
  int texts = 0;
  for (const char* extension : {".txt", ".json", ".md"})
    for (const auto& file : committed(extension)) {
      ++texts;
      std::ifstream in(file);
      for (std::string line; std::getline(in, line);)
        EXPECT_FALSE(std::regex_search(line, folder)) << file << ": " << line;
    }
  EXPECT_GT(texts, 30);
}

TEST(Provenance, OfAProgramWithChangesIsNoRevision) {
  EXPECT_TRUE(is_revision("4015a50"));
  for (const char* no : {"4015a50-dirty", "unknown", "", "4015a5"}) EXPECT_FALSE(is_revision(no)) << no;
}

}  // namespace
}  // namespace decant
