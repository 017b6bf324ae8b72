// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * @class   vtkHaliteMapper
 * @brief   exact volume rendering of unstructured grids
 *
 * Draws any vtkUnstructuredGrid, and the structured kinds of grids, as a volume, by Halite: every pixel is the emission-absorption integral of the field that
 * the grid defines. Grids need no triangulation: tetrahedra, voxels, hexahedra, wedges and pyramids may be mixed, cells of two
 * dimensions and less are left out, and so are ghost, duplicate and hidden cells and cells with hidden points.
 *
 * Honoured are: scalar modes and SelectScalarArray; arrays of any layout and number type; of vtkVolumeProperty the colour or grey
 * function of component 0 in any colour space, its scalar opacity and that unit distance, and IndependentComponents: on, one component
 * or the magnitude is drawn as the colour function's vector mode says; off, two components are the values of the colour and opacity
 * functions, four are red, green, blue and opacity themselves (as in vtkProjectedTetrahedraMapper); both blend modes;
 * clipping planes; the volume's matrix, mirror images included; any camera; opaque geometry, wherever it is, and with depth peeling
 * of volumes translucent geometry (except with the maximum, which goes over it). Of unstructured and structured grids whose points
 * have one value each, also shading by the lights of the renderer, gradient opacity over the length of the gradient in world units,
 * and 2D transfer functions (Song et al. 2009); others are drawn without, which is said once as a warning.
 *
 * It is a vtkProjectedTetrahedraMapper so that it can take that one's place through VTK's object factory (see SetOverride). What
 * VTK's own implementation can be told is accepted; sort and frame buffer format change nothing here.
 *
 * Nothing is drawn anew while camera, data, functions and opaque geometry stay as they are. What fails is an error by
 * vtkErrorMacro, said once, and leaves the volume out of the picture.
 *
 * @sa
 * vtkProjectedTetrahedraMapper vtkVolumeProperty
 */
#ifndef vtkHaliteMapper_h
#define vtkHaliteMapper_h

#include "vtkHaliteModule.h" // for export macro
#include "vtkProjectedTetrahedraMapper.h"

#include <memory> // for std::unique_ptr
#include <string> // for std::string
#include <vector> // for std::vector

#ifdef VTK_ABI_NAMESPACE_BEGIN
VTK_ABI_NAMESPACE_BEGIN
#endif

class VTKHALITE_EXPORT vtkHaliteMapper : public vtkProjectedTetrahedraMapper
{
public:
  static vtkHaliteMapper* New();
  vtkTypeMacro(vtkHaliteMapper, vtkProjectedTetrahedraMapper);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  void Render(vtkRenderer* renderer, vtkVolume* volume) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;
  bool IsSupported(vtkRenderWindow* window) override;

  ///@{
  /**
   * Of all that is drawn: (xmin, xmax, ymin, ymax, zmin, zmax).
   */
  double* GetBounds() VTK_SIZEHINT(6) override;
  using vtkProjectedTetrahedraMapper::GetBounds;
  ///@}

  ///@{
  /**
   * What is drawn: a vtkUnstructuredGrid, vtkImageData, vtkRectilinearGrid or vtkStructuredGrid. Image data and rectilinear grids
   * are drawn as the trilinear fields that they are, by the CPU, whatever the Device; with the interpolation type of the property
   * nearest (which is its default) as the value of the nearest point, unless points or cells are hidden. A composite data set of image
   * data and rectilinear grids (SetInputConnection, SetInputDataObject) is drawn grid by grid, the nearest first: right where boxes
   * around them do not overlap and none hides another in a circle. Grids without the array are left out; a maximum is of one grid.
   */
  void SetInputData(vtkDataSet* grid) override;
  void SetInputData(vtkUnstructuredGridBase* grid) override;
  ///@}

  ///@{
  /**
   * Where frames are computed: "auto" (the default: a GPU if there is one, else the CPU), "cpu", or a GPU by its index, its UUID or a
   * part of its name. The environment variable HALITE_DEVICE overrides "auto".
   */
  vtkSetStringMacro(Device);
  vtkGetStringMacro(Device);
  ///@}

  enum Engines
  {
    AUTO_ENGINE,
    TRAVERSE,
    PROJECT
  };

  ///@{
  /**
   * How: AUTO_ENGINE (the default), which is PROJECT on the CPU and TRAVERSE on a device for graphics; TRAVERSE, by rays that walk
   * from cell to cell; or PROJECT, which projects cells. On the CPU their order is verified in every pixel, so pictures are those of
   * the walk. On a device they are put in an order that is right for every pixel, unless cells overlap. As a string it has the name
   * that scene files and the program know it by, "auto", "traverse" or "project".
   */
  vtkSetClampMacro(Engine, int, AUTO_ENGINE, PROJECT);
  vtkGetMacro(Engine, int);
  void SetEngineToAuto() { this->SetEngine(AUTO_ENGINE); }
  void SetEngineToTraverse() { this->SetEngine(TRAVERSE); }
  void SetEngineToProject() { this->SetEngine(PROJECT); }
  const char* GetEngineAsString();
  ///@}

  enum Integrals
  {
    EXACT,
    AUTO_INTEGRAL,
    VOLUME,
    POLYNOMIAL,
    CYLINDRICAL,
    SECOND_ORDER,
    SECOND_ORDER_POLYNOMIAL
  };

  ///@{
  /**
   * The form of the ray integral: EXACT (the default); a pre-integrated table, VOLUME, POLYNOMIAL or CYLINDRICAL (and for a
   * Reconstruction by PARABOLAS SECOND_ORDER, of one length, or SECOND_ORDER_POLYNOMIAL, of all); or
   * AUTO_INTEGRAL: exact, or a table where a function has so many points that it is faster. On images and rectilinear grids tables are
   * for arrays of which one component or the magnitude is drawn. After an edit of the volume's property frames are exact until the
   * table is built anew, which happens meanwhile; after a change of this or of what follows, the next frame waits for it. As a string:
   * "exact", "auto", "volume", "polynomial", "cylindrical", "second-order" or "second-order-polynomial".
   */
  vtkSetClampMacro(Integral, int, EXACT, SECOND_ORDER_POLYNOMIAL);
  vtkGetMacro(Integral, int);
  void SetIntegralToExact() { this->SetIntegral(EXACT); }
  void SetIntegralToAuto() { this->SetIntegral(AUTO_INTEGRAL); }
  void SetIntegralToVolume() { this->SetIntegral(VOLUME); }
  void SetIntegralToPolynomial() { this->SetIntegral(POLYNOMIAL); }
  void SetIntegralToCylindrical() { this->SetIntegral(CYLINDRICAL); }
  void SetIntegralToSecondOrder() { this->SetIntegral(SECOND_ORDER); }
  void SetIntegralToSecondOrderPolynomial() { this->SetIntegral(SECOND_ORDER_POLYNOMIAL); }
  const char* GetIntegralAsString();
  ///@}

  ///@{
  /**
   * Texels of the table: values in front, values behind, and lengths of a volume or planes of a cylinder. A volume has at least
   * 2 x 2 x 3; the others have as many in front as behind, at least 2; a cylinder's planes are a multiple of 4; polynomials have
   * as many layers as their degree wants, and the third number is not read. At most 1 GiB, at 16 bytes each. All 0 (the default):
   * as many as suit the function.
   */
  vtkSetVector3Macro(TableSize, int);
  vtkGetVector3Macro(TableSize, int);
  ///@}

  enum Texels
  {
    FLOAT32,
    UNORM16,
    UNORM8
  };

  ///@{
  /**
   * What the table's texels are: FLOAT32 (32-bit floats, the default), or UNORM16 or UNORM8, 16 or 8 bits of the range that there is.
   * As a string: "float", "unorm16" or "unorm8".
   */
  vtkSetClampMacro(TableTexels, int, FLOAT32, UNORM8);
  vtkGetMacro(TableTexels, int);
  void SetTableTexelsToFloat32() { this->SetTableTexels(FLOAT32); }
  void SetTableTexelsToUnorm16() { this->SetTableTexels(UNORM16); }
  void SetTableTexelsToUnorm8() { this->SetTableTexels(UNORM8); }
  const char* GetTableTexelsAsString();
  ///@}

  ///@{
  /**
   * The degree of polynomials, from 1 to 8; 2 by default.
   */
  vtkSetMacro(PolynomialDegree, int);
  vtkGetMacro(PolynomialDegree, int);
  ///@}

  enum OpacityConventions
  {
    EXTINCTION,
    OPACITY,
    BY_INPUT
  };

  ///@{
  /**
   * What opacity a and unit distance d mean. EXTINCTION: the extinction per unit length is a / d, as in VTK's mappers of
   * unstructured grids. OPACITY: it is -ln(1 - a) / d, as in those of image data. BY_INPUT (the default): what VTK's mappers of such
   * an input have, OPACITY for image data and rectilinear grids, and EXTINCTION for others.
   */
  vtkSetClampMacro(OpacityConvention, int, EXTINCTION, BY_INPUT);
  vtkGetMacro(OpacityConvention, int);
  void SetOpacityConventionToExtinction() { this->SetOpacityConvention(EXTINCTION); }
  void SetOpacityConventionToOpacity() { this->SetOpacityConvention(OPACITY); }
  void SetOpacityConventionToByInput() { this->SetOpacityConvention(BY_INPUT); }
  const char* GetOpacityConventionAsString();
  ///@}

  ///@{
  /**
   * The array that takes the place of the gradient's length as second variable, beside the one that is drawn; none by default. An
   * image that is a 2D transfer function with an origin or a spacing of its own has the centres of its texels where its points are.
   * Others lie over the range of the scalars, and over that of this array, or lengths of the gradient up to a quarter of the range.
   */
  vtkSetStringMacro(Transfer2DYAxisArray);
  vtkGetStringMacro(Transfer2DYAxisArray);
  ///@}

  ///@{
  /**
   * Widgets over the scalar and the second variable, whose colours and opacities add up in the place of the property's functions, each
   * as scene files have them: {"type": "gaussian", "center": [0.5, 2], "sigma": [0.1, 1], "color": [1, 0.5, 0], "opacity": 0.8}.
   */
  void AddWidget(const char* widget);
  void RemoveAllWidgets();
  int GetNumberOfWidgets();
  ///@}

  ///@{
  /**
   * p, where extinction is multiplied by (1 - |n.d|)^p, with n the unit vector of the gradient and d the direction of the ray: what
   * faces the eye becomes clear, and outlines are left. Negative (the default): it is not.
   */
  vtkSetMacro(SilhouettePower, double);
  vtkGetMacro(SilhouettePower, double);
  ///@}

  enum Reconstructions
  {
    TRILINEAR,
    PARABOLAS,
    LINES,
    MIDDLE_SAMPLES,
    LEFT_SAMPLES,
    RIGHT_SAMPLES
  };

  ///@{
  /**
   * Of regular and rectilinear grids, what stands for the field between samples along rays: TRILINEAR (the field itself, which takes
   * no samples; the default), PARABOLAS, LINES, or rectangles as high as the sample in the middle, on the left or on the right. As a
   * string: "exact", "2", "1", "0", "0-left" or "0-right".
   */
  vtkSetClampMacro(Reconstruction, int, TRILINEAR, RIGHT_SAMPLES);
  vtkGetMacro(Reconstruction, int);
  void SetReconstructionToTrilinear() { this->SetReconstruction(TRILINEAR); }
  void SetReconstructionToParabolas() { this->SetReconstruction(PARABOLAS); }
  void SetReconstructionToLines() { this->SetReconstruction(LINES); }
  void SetReconstructionToMiddleSamples() { this->SetReconstruction(MIDDLE_SAMPLES); }
  void SetReconstructionToLeftSamples() { this->SetReconstruction(LEFT_SAMPLES); }
  void SetReconstructionToRightSamples() { this->SetReconstruction(RIGHT_SAMPLES); }
  const char* GetReconstructionAsString();
  ///@}

  ///@{
  /**
   * From sample to sample of a reconstruction that takes such, in world units; 0 (the default): at the faces of voxels and midway.
   */
  vtkSetClampMacro(SampleDistance, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(SampleDistance, double);
  ///@}

  ///@{
  /**
   * Whether only some of the 27 regions are drawn that two planes across each axis make, as vtkVolumeMapper has them; off by default.
   * The planes (xmin, xmax, ymin, ymax, zmin, zmax) are in the coordinates of the data, which the volume then moves. Bit x + 3 y + 9 z
   * of the flags is that of region (x, y, z), each from 0 to 2; at first the one in the middle is drawn.
   */
  vtkSetMacro(Cropping, vtkTypeBool);
  vtkGetMacro(Cropping, vtkTypeBool);
  vtkBooleanMacro(Cropping, vtkTypeBool);
  vtkSetVector6Macro(CroppingRegionPlanes, double);
  vtkGetVectorMacro(CroppingRegionPlanes, double, 6);
  vtkSetClampMacro(CroppingRegionFlags, int, 0x0, 0x7ffffff);
  vtkGetMacro(CroppingRegionFlags, int);
  void SetCroppingRegionFlagsToSubVolume() { this->SetCroppingRegionFlags(0x0002000); }
  void SetCroppingRegionFlagsToFence() { this->SetCroppingRegionFlags(0x2ebfeba); }
  void SetCroppingRegionFlagsToInvertedFence() { this->SetCroppingRegionFlags(0x5140145); }
  void SetCroppingRegionFlagsToCross() { this->SetCroppingRegionFlags(0x0417410); }
  void SetCroppingRegionFlagsToInvertedCross() { this->SetCroppingRegionFlags(0x7be8bef); }
  ///@}

  ///@{
  /**
   * Distance between rays, in pixels: with 2, a fourth of the pixels is computed, and enlarged. 1 by default.
   */
  vtkSetClampMacro(ImageSampleDistance, double, 1.0, 100.0);
  vtkGetMacro(ImageSampleDistance, double);
  ///@}

  ///@{
  /**
   * The distance that is used instead while the host interacts (SetInteracting), if it is greater. 4 by default; 1 draws as at rest,
   * and 0 leaves it to the host to show something else meanwhile, which is up to that host.
   */
  vtkSetClampMacro(InteractiveImageSampleDistance, double, 0.0, 100.0);
  vtkGetMacro(InteractiveImageSampleDistance, double);
  ///@}

  ///@{
  /**
   * Whether the host interacts: the user drags the camera, and wants frames soon. Off by default; VTK alone never turns it on.
   */
  vtkSetMacro(Interacting, bool);
  vtkGetMacro(Interacting, bool);
  ///@}

  ///@{
  /**
   * Whether pictures are half a step of 1/255 brighter and more opaque where anything is seen. Hosts that blend the pictures of several
   * processes as bytes round down in each blend, half a step on average, which this makes up for. Off by default.
   */
  vtkSetMacro(RoundingUp, bool);
  vtkGetMacro(RoundingUp, bool);
  ///@}

  ///@{
  /**
   * Threads of this mapper where the CPU draws. 0 (the default): as many as the environment variable HALITE_THREADS says; without it,
   * one for each core that this process may use. Of processes that an MPI launcher started, each has its share of the node's cores. The
   * environment variable VTK_SMP_MAX_THREADS limits both.
   */
  vtkSetClampMacro(NumberOfThreads, int, 0, 1024);
  vtkGetMacro(NumberOfThreads, int);
  ///@}

  ///@{
  /**
   * Accepted because VTK's own mapper has it. Halite's pictures are always made of 32-bit floats.
   */
  vtkSetMacro(UseFloatingPointFrameBuffer, bool);
  vtkGetMacro(UseFloatingPointFrameBuffer, bool);
  vtkBooleanMacro(UseFloatingPointFrameBuffer, bool);
  ///@}

  /**
   * Whether vtkProjectedTetrahedraMapper::New() makes mappers of this class, where nobody asks for it by name. Importing the Python
   * package, loading the library through VTK_AUTOLOAD_PATH and linking the module with vtk_module_autoinit turn it on, unless the
   * environment variable HALITE_OVERRIDE is 0.
   */
  static void SetOverride(bool on);
  static bool GetOverride();

  /**
   * As SetOverride(true), unless HALITE_OVERRIDE is 0: what importing and linking do.
   */
  static void RegisterOverride();

  ///@{
  /**
   * What the last frames took, in seconds: bringing what changed to the core; reading the depth buffer; the core's picture;
   * uploading and blending it. What a frame did not do took 0.
   */
  vtkGetMacro(PrepareTime, double);
  vtkGetMacro(DepthTime, double);
  vtkGetMacro(CoreTime, double);
  vtkGetMacro(PresentTime, double);
  ///@}

  ///@{
  /**
   * How often, since this mapper was made: the core drew; mesh, points, field and transfer function were handed to it; an
   * array's layout forced a copy.
   */
  vtkIdType GetNumberOfFrames();
  vtkIdType GetNumberOfMeshUploads();
  vtkIdType GetNumberOfPointUploads();
  vtkIdType GetNumberOfFieldUploads();
  vtkIdType GetNumberOfFunctionUploads();
  vtkIdType GetNumberOfCopies();
  ///@}

  /**
   * The processor or adapter that drew last, and tetrahedra drawn.
   */
  const char* GetAdapter();
  vtkIdType GetNumberOfTetrahedra();

protected:
  vtkHaliteMapper();
  ~vtkHaliteMapper() override;

  char* Device = nullptr;
  int Engine = AUTO_ENGINE;
  int Integral = EXACT;
  int TableSize[3] = { 0, 0, 0 };
  int TableTexels = FLOAT32;
  int PolynomialDegree = 2;
  int OpacityConvention = BY_INPUT;
  char* Transfer2DYAxisArray = nullptr;
  std::vector<std::string> Widgets;
  double SilhouettePower = -1;
  int Reconstruction = TRILINEAR;
  double SampleDistance = 0;
  vtkTypeBool Cropping = 0;
  double CroppingRegionPlanes[6] = { 0, 1, 0, 1, 0, 1 };
  int CroppingRegionFlags = 0x0002000;
  double ImageSampleDistance = 1.0;
  double InteractiveImageSampleDistance = 4.0;
  bool Interacting = false;
  bool RoundingUp = false;
  int NumberOfThreads = 0;
  bool UseFloatingPointFrameBuffer = true;

  double PrepareTime = 0;
  double DepthTime = 0;
  double CoreTime = 0;
  double PresentTime = 0;

  /**
   * Draws what was put off until a renderer has finished.
   */
  void DrawDeferred(vtkObject* caller, unsigned long event, void* data);

  int FillInputPortInformation(int port, vtkInformation* information) override;

private:
  vtkHaliteMapper(const vtkHaliteMapper&) = delete;
  void operator=(const vtkHaliteMapper&) = delete;

  struct Internals;
  std::unique_ptr<Internals> Inner;
};

#ifdef VTK_ABI_NAMESPACE_END
VTK_ABI_NAMESPACE_END
#endif
#endif
