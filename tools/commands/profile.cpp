/// \file
/// ncu's command line, its CSV, and the figures made of it.
#include "tools/commands/profile.hpp"

#include "tools/commands/backend_choice.hpp"

#include <fmt/format.h>
#include <sys/wait.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <regex>
#include <sstream>

namespace decant::profile {

const std::array<Counter, 26> counters = {{
    {"time", "gpu__time_duration.sum", nullptr, nullptr, 1e-3, "us", "us"},
    {"grid", "launch__grid_size", nullptr, nullptr, 1, "1", nullptr},
    {"block", "launch__block_size", nullptr, nullptr, 1, "1", nullptr},
    {"registers", "launch__registers_per_thread", nullptr, nullptr, 1, "1", "registers"},
    {"shared_memory", "launch__shared_mem_per_block", nullptr, nullptr, 1, "byte", "shared B"},
    {"occupancy_theoretical", "sm__maximum_warps_per_active_cycle_pct", nullptr, nullptr, 1, "%", "occ. max"},
    {"occupancy_achieved", "sm__warps_active.avg.pct_of_peak_sustained_active", nullptr, nullptr, 1, "%", "achieved"},
    {"issue_utilisation", "smsp__issue_active.avg.pct_of_peak_sustained_active", nullptr, nullptr, 1, "%", "issue %"},
    {"active_lanes", "smsp__thread_inst_executed_per_inst_executed.ratio", nullptr, nullptr, 1, "1", "lanes"},
    {"instructions", "smsp__inst_executed.sum", nullptr, nullptr, 1, "1", nullptr},
    {"l1_sectors", "l1tex__t_sectors_pipe_lsu_mem_global_op_ld.sum", nullptr, nullptr, 1, "1", nullptr},
    {"l1_requests", "l1tex__t_requests_pipe_lsu_mem_global_op_ld.sum", nullptr, nullptr, 1, "1", nullptr},
    {"sectors_per_request", "l1tex__t_sectors_pipe_lsu_mem_global_op_ld.sum", nullptr,
     "l1tex__t_requests_pipe_lsu_mem_global_op_ld.sum", 1, "1", "sect./req."},
    {"l2_sectors", "lts__t_sectors.sum", nullptr, nullptr, 1, "1", nullptr},
    {"global_sectors", "memory_l2_theoretical_sectors_global", nullptr, nullptr, 1, "1", nullptr},
    {"excessive_sectors", "memory_l2_theoretical_sectors_global", "memory_l2_theoretical_sectors_global_ideal", nullptr,
     1, "1", nullptr},
    {"excessive_share", "memory_l2_theoretical_sectors_global", "memory_l2_theoretical_sectors_global_ideal",
     "memory_l2_theoretical_sectors_global", 100, "%", "excess %"},
    {"l1_hit_rate", "l1tex__t_sector_hit_rate.pct", nullptr, nullptr, 1, "%", "L1 hit %"},
    {"l2_hit_rate", "lts__t_sector_hit_rate.pct", nullptr, nullptr, 1, "%", "L2 hit %"},
    {"dram_bytes", "dram__bytes.sum", nullptr, nullptr, 1e-6, "MB", "DRAM MB"},
    {"l2_bytes", "lts__t_bytes.sum", nullptr, nullptr, 1e-6, "MB", nullptr},
    {"ffma", "smsp__sass_thread_inst_executed_op_ffma_pred_on.sum", nullptr, nullptr, 1, "1", nullptr},
    {"fadd", "smsp__sass_thread_inst_executed_op_fadd_pred_on.sum", nullptr, nullptr, 1, "1", nullptr},
    {"fmul", "smsp__sass_thread_inst_executed_op_fmul_pred_on.sum", nullptr, nullptr, 1, "1", nullptr},
    {"shared_wavefronts", "l1tex__data_pipe_lsu_wavefronts_mem_shared.sum", nullptr, nullptr, 1, "1", nullptr},
    {"shared_requests", "smsp__sass_inst_executed_op_shared.sum", nullptr, nullptr, 1, "1", nullptr},
}};

const std::array<const char*, 11> stalls = {"long_scoreboard", "short_scoreboard",   "wait",        "barrier",
                                            "not_selected",    "math_pipe_throttle", "lg_throttle", "mio_throttle",
                                            "branch_resolve",  "no_instruction",     "membar"};

namespace {

constexpr std::size_t longest_name = 60;
constexpr double none = std::numeric_limits<double>::quiet_NaN();

std::string stall_metric(const char* name) {
  return fmt::format("smsp__average_warps_issue_stalled_{}_per_issue_active.ratio", name);
}

/// The cells of a line of quoted CSV.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    else if (c == ',' && !quoted) cells.push_back(std::exchange(cell, {}));
    else if (c != '\r') cell += c;
  }
  cells.push_back(cell);
  return cells;
}

double number(std::string text) {
  std::erase(text, ',');
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return text.empty() || *end != '\0' ? none : value;
}

/// "density_kernel<SubWarp<2>, …>" of a demangled name with namespaces, types of parameters and casts. ncu writes an
/// unnamed namespace in full, "decant::<unnamed>::SubWarp", or without its bracket, "density_kernel<unnamed>::TileTeam".
std::string short_name(const std::string& name) {
  static const std::regex whole(R"((::|^|[ ,<])<unnamed>::)"), half("unnamed>::");
  static const std::regex noise(R"(decant::|gpu::|cuda::|\(anonymous namespace\)::|void |\(int\)|\(bool\))");
  std::string plain = std::regex_replace(std::regex_replace(name, whole, "$1"), half, "");
  plain = std::regex_replace(plain, noise, "");
  plain = plain.substr(0, plain.find('('));
  return plain.size() > longest_name ? plain.substr(0, longest_name - 1) + "…" : plain;
}

std::string quoted(const std::string& word) {
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::string metrics() {
  std::string all;
  const auto add = [&](const std::string& metric) {
    if (("," + all + ",").find("," + metric + ",") == std::string::npos) all += (all.empty() ? "" : ",") + metric;
  };
  for (const Counter& c : counters) {
    add(c.metric);
    if (c.less) add(c.less);
    if (c.over) add(c.over);
  }
  for (const char* stall : stalls) add(stall_metric(stall));
  return all;
}

}  // namespace

std::string Kernel::largest_stall() const {
  std::size_t largest = 0;
  double value = none;
  for (std::size_t k = 0; k < stalls.size(); ++k)
    if (const double found = values[counters.size() + k]; !std::isnan(found) && !(found <= value))
      value = values[counters.size() + (largest = k)];
  return std::isnan(value) ? "-" : fmt::format("{} {:.1f}", stalls[largest], value);
}

std::vector<Kernel> kernels_in(const std::string& csv) {
  std::map<std::string, std::size_t> column;
  std::vector<Kernel> kernels;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() != '"') continue;
    const std::vector<std::string> cells = cells_of(line);
    if (std::ranges::find(cells, "Kernel Name") != cells.end()) {
      column.clear();
      for (std::size_t k = 0; k < cells.size(); ++k) column[cells[k]] = k;
      continue;
    }
    // The line below the heading holds units, and no number of a launch.
    if (column.empty() || cells.size() != column.size() || std::isnan(number(cells[column.at("ID")]))) continue;
    const auto value = [&](const std::string& metric) {
      const auto at = column.find(metric);
      return at == column.end() ? none : number(cells[at->second]);
    };
    Kernel kernel{short_name(cells[column.at("Kernel Name")]), {}};
    for (const Counter& c : counters) {
      const double below = c.over ? value(c.over) : 1;
      const double above = value(c.metric) - (c.less ? value(c.less) : 0);
      kernel.values.push_back(c.over && below == 0 ? 0 : c.scale * above / below);
    }
    for (const char* stall : stalls) kernel.values.push_back(value(stall_metric(stall)));
    const auto known = std::ranges::find(kernels, kernel.name, &Kernel::name);
    if (known == kernels.end()) kernels.push_back(std::move(kernel));
    else *known = std::move(kernel);
  }
  if (column.empty()) throw BackendError("ncu printed no table of kernels");
  return kernels;
}

std::vector<Kernel> of_backend(const std::string& fixture, const std::string& choice, const std::string& executor) {
  const char* named = std::getenv("DECANT_NCU");
  // Every launch is run again for each group of counters: a call of a plug-in takes longer than it may otherwise.
  const std::string patient =
      is_plugin(choice) && choice.find(":time_limit=") == std::string::npos ? choice + ":time_limit=600" : choice;
  std::string command = quoted(named && *named ? named : "ncu");
  // A plug-in's process says nothing of when its setting up is over.
  command += is_plugin(choice) ? "" : " --profile-from-start off";
  command += " --clock-control none --target-processes all --csv --page raw --print-units base --metrics " + metrics();
  command += " " + quoted(std::filesystem::read_symlink("/proc/self/exe").string()) + " bench " + quoted(fixture);
  command += " --profile-child --executor " + quoted(executor) + " --backend " + quoted(patient) + " 2>&1";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  if (!pipe) throw BackendError("ncu: no process for it");
  std::string said;
  std::array<char, 65536> part;
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), pipe)) said.append(part.data(), size);
  const int status = ::pclose(pipe);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    std::string why, line;
    for (std::istringstream lines(said); std::getline(lines, line);) {
      const bool error = line.find("ERROR") != std::string::npos || line.starts_with("decant:");
      if (why.empty() ? !line.empty() && line.front() != '"' : error && why.find("ERROR") == std::string::npos)
        why = line;
    }
    throw BackendError(fmt::format("ncu (DECANT_NCU names another) cannot profile {}: {}", choice,
                                   why.empty() ? "it said nothing" : why));
  }
  if (said.find("No kernels were profiled") != std::string::npos)
    throw BackendError(choice + " launched no kernel: there is nothing to profile on a host");
  return kernels_in(said);
}

std::string table(const std::vector<Kernel>& kernels) {
  std::size_t widest = 6;
  for (const Kernel& kernel : kernels) widest = std::max(widest, std::min<std::size_t>(kernel.name.size(), 50));
  std::string text = fmt::format("{:<{}}", "kernel", widest);
  for (const Counter& c : counters)
    if (c.heading) text += fmt::format("  {:>10}", c.heading);
  text += "  largest stall\n";
  for (const Kernel& kernel : kernels) {
    text += fmt::format("{:<{}}", kernel.name.substr(0, widest), widest);
    for (std::size_t k = 0; k < counters.size(); ++k)
      if (counters[k].heading)
        text +=
            std::isnan(kernel.values[k]) ? fmt::format("  {:>10}", "-") : fmt::format("  {:>10.4g}", kernel.values[k]);
    text += "  " + kernel.largest_stall() + "\n";
  }
  return text;
}

std::string json(const std::string& fixture, const std::string& choice, const std::vector<Kernel>& kernels) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const Kernel& kernel : kernels) {
    nlohmann::ordered_json one = {{"kernel", kernel.name}};
    const auto put = [&](const std::string& name, double value) {
      if (!std::isnan(value)) one[name] = value;
    };
    for (std::size_t k = 0; k < counters.size(); ++k) put(counters[k].name, kernel.values[k]);
    for (std::size_t k = 0; k < stalls.size(); ++k)
      put(std::string("stall_") + stalls[k], kernel.values[counters.size() + k]);
    all.push_back(one);
  }
  return nlohmann::ordered_json{{"fixture", fixture}, {"backend", choice}, {"kernels", all}}.dump(2);
}

}  // namespace decant::profile
