# SPDX-License-Identifier: MIT
# The VTK modules behind palpate::vtk and how to find them; the build and the installed package read this same file.
set(palpate_vtk_modules
    ChartsCore
    CommonCore
    CommonDataModel
    CommonExecutionModel
    FiltersCore
    FiltersGeneral
    FiltersGeometry
    FiltersSources
    IOCore
    IOGeometry
    IOImage
    IOLegacy
    IOPLY
    IOXML
    InteractionStyle
    RenderingContext2D
    RenderingContextOpenGL2
    RenderingAnnotation
    RenderingCore
    RenderingFreeType
    RenderingOpenGL2
    ViewsContext2D)

macro(palpate_find_vtk)
  find_package(VTK 9 QUIET COMPONENTS ${palpate_vtk_modules})
  # A VTK that was built with MPI, as Debian's is, names MPI::MPI_C behind ChartsCore. CMake makes that target only in
  # projects that enable C. Nothing here calls MPI, so an empty one will do.
  if(VTK_FOUND AND TARGET VTK::mpi AND NOT TARGET MPI::MPI_C)
    add_library(MPI::MPI_C INTERFACE IMPORTED)
  endif()
endmacro()
