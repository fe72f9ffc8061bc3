// SPDX-License-Identifier: MIT
// Looks at pictures of wounds: the organ fills a good part, nothing of it leaves the frame, and the wound is seen.
//   check_pictures one.png another.png ...
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

namespace {

using Colour = std::array<int, 3>;

bool is_good(char const* file) {
  vtkNew<vtkPNGReader> reader;
  if (!reader->CanReadFile(file)) return std::printf("FAILED: %s is no PNG\n", file), false;
  reader->SetFileName(file);
  reader->Update();
  vtkImageData* const image = reader->GetOutput();
  int const width = image->GetDimensions()[0], height = image->GetDimensions()[1];
  auto const at = [&](int x, int y) {
    Colour rgb{};
    for (int c = 0; c < 3; ++c)
      rgb[static_cast<std::size_t>(c)] = static_cast<int>(image->GetScalarComponentAsDouble(x, y, 0, c));
    return rgb;
  };
  auto const differ = [](Colour const& a, Colour const& b) {
    return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])}) > 12;
  };
  int organ = 0, wound = 0, at_the_edge = 0;
  for (int y = 0; y < height; ++y) {
    Colour const background = at(0, y);   // the same across a row
    for (int x = 0; x < width; ++x) {
      Colour const rgb = at(x, y);
      if (!differ(rgb, background)) continue;
      ++organ;
      at_the_edge += x < 4 || x >= width - 4 || y < 4 || y >= height - 4;
      wound += rgb[0] > 25 && rgb[0] > 4 * std::max(rgb[1], rgb[2]);   // a purer red than the tissue's
    }
  }
  double const all = double(width) * height, seen = organ / all, open = wound / all;
  bool const good = width >= 640 && seen > 0.1 && seen < 0.9 && at_the_edge == 0 && open > 0.004;
  std::printf("%s%s: %d x %d, organ %.1f %%, wound %.2f %%, at the edge %d\n", good ? "" : "FAILED: ", file, width, height,
              100.0 * seen, 100.0 * open, at_the_edge);
  return good;
}

}  // namespace

int main(int argc, char** argv) {
  bool good = argc > 1;
  for (int k = 1; k < argc; ++k) good = is_good(argv[k]) && good;
  return good ? 0 : 1;
}
