// SPDX-License-Identifier: MIT
// Error over cost, stability limit and energy of every integrator in every scene, as a CSV file and charts:
//   work_precision <folder> [scene …]   some minutes for all scenes; for numbers that count build with the preset release
//   work_precision --quick <folder>     seconds: small scenes, and checks that the numbers obey known laws
#include "all.hpp"
#include "charts.hpp"
#include "laws.hpp"
#include "tables.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

int main(int count, char** arguments) {
  using namespace work_precision;
  std::vector<std::string> words(arguments + 1, arguments + count);
  bool const quick = !words.empty() && words[0] == "--quick";
  if (quick) words.erase(words.begin());
  if (words.empty() || words[0].starts_with('-')) {
    std::fprintf(stderr, "usage: work_precision [--quick] <folder> [scene ...]\n");
    return 2;
  }
  try {
    std::vector<Scene> scenes = quick ? quick_scenes() : all_scenes();
    std::string names;
    for (Scene const& scene : scenes) names += (names.empty() ? "" : ", ") + scene.name;
    for (auto word = words.begin() + 1; word != words.end(); ++word)
      if (std::none_of(scenes.begin(), scenes.end(), [&](Scene const& scene) { return scene.name == *word; })) {
        std::fprintf(stderr, "work_precision: there is no scene \"%s\"%s; there are %s\n", word->c_str(), quick ? " with --quick" : "", names.c_str());
        return 2;
      }
    std::filesystem::path const folder = words[0];
    auto const wanted = [&](Scene const& scene) { return words.size() == 1 || std::find(words.begin() + 1, words.end(), scene.name) != words.end(); };
    std::filesystem::create_directories(folder);
    Effort const effort = quick ? Effort{.longest_run = 0.02, .repeats = 1, .energy_steps = 500, .limit_steps = 1000} : Effort{};
    Rows rows;
    for (Scene& scene : scenes) {
      if (!wanted(scene)) continue;
      Case const at = prepare(std::move(scene));
      Row row = at.row("reference", "");
      row.error = at.reference.own_error;
      row.status = at.reference.source;
      rows.push_back(row);
      print_reference(at);
      std::fflush(stdout);
      compare_all(rows, at, effort);
    }
    for (Row const& row : thesis_rows()) rows.push_back(row);
    write_csv(folder / "work_precision.csv", rows);
    print_tables(rows);
    auto const charts = write_charts(folder, rows, integrator_names());
    std::printf("\nwritten: %s", (folder / "work_precision.csv").string().c_str());
    for (auto const& chart : charts) std::printf(", %s", chart.filename().string().c_str());
    std::printf("\n");
    return quick ? check_laws(rows) : 0;
  } catch (std::exception const& error) {
    std::fprintf(stderr, "work_precision: %s\n", error.what());
    return 1;
  }
}
