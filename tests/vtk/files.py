"""files.py write FOLDER: files of all kinds, written by VTK. files.py dump OUT FILE...: what VTK reads from them.

Needs VTK 9 and nothing else. A dump is one file: lines of text, each followed by as many bytes as it says."""
import os, sys
import vtk

SIZES = {1: "u1", 2: "i1", 15: "i1", 3: "u1", 4: "i2", 5: "u2", 6: "i4", 7: "u4", 8: "i8", 9: "u8", 10: "f4", 11: "f8", 12: "i8", 16: "i8", 17: "u8"}

VERSION = (vtk.vtkVersion.GetVTKMajorVersion(), vtk.vtkVersion.GetVTKMinorVersion())


def numbers(array):
    """Kind and bytes of an array."""
    if array.GetDataType() == 1:
        return "u1", bytes(array.GetValue(i) for i in range(array.GetNumberOfValues()))
    kind = SIZES[array.GetDataType()]
    if kind[0] != "f" and int(kind[1]) != array.GetDataTypeSize():
        kind = kind[0] + str(array.GetDataTypeSize())
    return kind, bytes(memoryview(array)) if array.GetNumberOfValues() else b""


def reader_of(path):
    with open(path, "rb") as file:
        start = file.read(200)
        # VTK 9.4 keeps the faces of polyhedra in arrays that earlier readers pass over.
        if VERSION < (9, 4) and b"face_connectivity" in file.read():
            return None
    if start.lower().startswith(b"# vtk datafile"):
        kinds = {b"STRUCTURED_POINTS": "StructuredPoints", b"RECTILINEAR_GRID": "RectilinearGrid", b"STRUCTURED_GRID": "StructuredGrid"}
        words = start.split()
        kind = words[words.index(b"DATASET") + 1] if b"DATASET" in words else b""
        return getattr(vtk, "vtk" + kinds.get(kind, "UnstructuredGrid") + "Reader")()
    kinds = {"vtu": "UnstructuredGrid", "vti": "ImageData", "vtr": "RectilinearGrid", "vts": "StructuredGrid"}
    extension = os.path.splitext(path)[1][1:]
    return getattr(vtk, "vtkXML" + ("P" if extension[0] == "p" else "") + kinds[extension[-3:]] + "Reader")()


def dump(out, path):
    def put(words, data=b""):
        out.write((" ".join(str(w) for w in words) + " " + str(len(data)) + "\n").encode() + data)

    put(["file"], os.fsencode(path))
    reader = reader_of(path)
    if reader is None:
        return put(["error"])
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(1))
    reader.SetFileName(path)
    if reader.IsA("vtkDataReader"):
        for what in ("Scalars", "Vectors", "Normals", "Tensors", "ColorScalars", "TCoords", "Fields"):
            getattr(reader, "ReadAll" + what + "On")()
    reader.Update()
    grid = reader.GetOutput()
    if errors:
        return put(["error"])
    if isinstance(grid, vtk.vtkPointSet):
        points = grid.GetPoints()
        if points is not None and points.GetNumberOfPoints():
            kind, data = numbers(points.GetData())
            put(["points", kind], data)
    else:
        points = vtk.vtkDoubleArray()
        for i in range(grid.GetNumberOfPoints()):
            for c in grid.GetPoint(i):
                points.InsertNextValue(c)
        put(["points", "f8"], numbers(points)[1])
    ids, types, ends, faces = vtk.vtkIdList(), vtk.vtkUnsignedCharArray(), vtk.vtkIdTypeArray(), vtk.vtkIdTypeArray()
    connectivity = vtk.vtkIdTypeArray()
    for c in range(grid.GetNumberOfCells()):
        vtk_type = grid.GetCellType(c)
        types.InsertNextValue(vtk_type)
        grid.GetCellPoints(c, ids)
        for i in range(ids.GetNumberOfIds()):
            connectivity.InsertNextValue(ids.GetId(i))
        ends.InsertNextValue(connectivity.GetNumberOfValues())
        if vtk_type == 42:
            grid.GetFaceStream(c, ids)
            for i in range(ids.GetNumberOfIds()):
                faces.InsertNextValue(ids.GetId(i))
    for name, array in (("types", types), ("ends", ends), ("connectivity", connectivity), ("faces", faces)):
        put([name], numbers(array)[1])
    for name, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
        for i in range(data.GetNumberOfArrays()):
            array = data.GetArray(i)
            if array is not None and array.GetName() and array.GetDataType() in SIZES:
                kind, values = numbers(array)
                put([name, kind, array.GetNumberOfComponents()], array.GetName().encode())
                put(["values"], values)
    put(["end"])


def grid_of(kinds, polyhedra=False):
    """One cell of each kind, side by side, with arrays of all number types."""
    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    points.SetDataTypeToDouble()
    cells = []
    for n, (vtk_type, order) in enumerate(kinds):
        source = vtk.vtkCellTypeSource()
        source.SetCellType(vtk_type)
        source.SetCellOrder(order)
        source.SetBlocksDimensions(1, 1, 1)
        source.Update()
        block = source.GetOutput()
        first = points.GetNumberOfPoints()
        for p in range(block.GetNumberOfPoints()):
            x, y, z = block.GetPoint(p)
            points.InsertNextPoint(x + 2 * n, y / 3, z * 1e-3)
        for c in range(block.GetNumberOfCells()):
            ids = block.GetCell(c).GetPointIds()
            cells.append((vtk_type, [first + ids.GetId(i) for i in range(ids.GetNumberOfIds())]))
    if polyhedra:
        first = points.GetNumberOfPoints()
        for z in (0, 1):
            for x, y in ((0, 0), (2, 0), (3, 1), (1, 2), (0, 1)):
                points.InsertNextPoint(x - 9, y, z)
        faces = [[4, 3, 2, 1, 0], [5, 6, 7, 8, 9]] + [[i, (i + 1) % 5, 5 + (i + 1) % 5, 5 + i] for i in range(5)]
        cells.append((42, [[first + i for i in face] for face in faces]))
    grid.SetPoints(points)
    grid.Allocate(len(cells))
    for vtk_type, ids in cells:
        ids_list = vtk.vtkIdList()
        if vtk_type == 42:
            ids_list.InsertNextId(len(ids))
            for face in ids:
                ids_list.InsertNextId(len(face))
                for i in face:
                    ids_list.InsertNextId(i)
        else:
            for i in ids:
                ids_list.InsertNextId(i)
        grid.InsertNextCell(vtk_type, ids_list)
    for data, count in ((grid.GetPointData(), grid.GetNumberOfPoints()), (grid.GetCellData(), grid.GetNumberOfCells())):
        for name in ("SignedChar", "UnsignedChar", "Short", "UnsignedShort", "Int", "UnsignedInt", "LongLong", "UnsignedLongLong", "Float", "Double"):
            array = getattr(vtk, "vtk" + name + "Array")()
            array.SetName(name)
            array.SetNumberOfComponents(3 if name in ("Float", "Short") else 1)
            array.SetNumberOfTuples(count)
            for i in range(array.GetNumberOfValues()):
                array.SetValue(i, (i * 37 % 101) + (0.1 if name in ("Float", "Double") else 0))
            data.AddArray(array)
        bits, words, ids, odd = vtk.vtkBitArray(), vtk.vtkStringArray(), vtk.vtkIdTypeArray(), vtk.vtkFloatArray()
        for array, name in ((bits, "Bit"), (words, "String"), (ids, "Ids"), (odd, "Odd")):
            array.SetName(name)
            for i in range(count):
                value = {"Bit": i * i % 3, "String": f"a b{i}", "Ids": 3 * i, "Odd": [float("nan"), 1, float("inf")][i % 3]}[name]
                array.InsertNextValue(value)
            if name == "Ids":
                data.SetGlobalIds(array)
            else:
                data.AddArray(array)
        tensors = vtk.vtkDoubleArray()
        tensors.SetName("Tensors6")
        tensors.SetNumberOfComponents(6)
        tensors.SetNumberOfTuples(count)
        for i in range(6 * count):
            tensors.SetValue(i, i)
        data.SetTensors(tensors)
    return grid


def without(grid, name):
    """The grid, but from an old VTK without arrays of that name, which it would not read as they were."""
    copy = vtk.vtkUnstructuredGrid()
    copy.ShallowCopy(grid)
    for data in (copy.GetPointData(), copy.GetCellData()) if VERSION < (9, 7) else ():
        data.RemoveArray(name)
    return copy


def blocks():
    """A grid of each kind that lists no cells, with the arrays of an unstructured one of as many points and cells."""
    image, uneven, bent = vtk.vtkImageData(), vtk.vtkRectilinearGrid(), vtk.vtkStructuredGrid()
    extent = (-2, 1, 3, 5, 7, 8)
    size = [extent[2 * a + 1] - extent[2 * a] + 1 for a in range(3)]
    image.SetExtent(extent)
    image.SetOrigin(1.5, -2, 1e3)
    image.SetSpacing(0.1, 2, 0.3)
    image.SetDirectionMatrix(0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1)
    uneven.SetExtent(extent)
    for a, name in enumerate("XYZ"):
        axis = vtk.vtkDoubleArray()
        for i in range(size[a]):
            axis.InsertNextValue((1 + 0.1 * i * i) * (-1 if a == 1 else 1) / 3)
        getattr(uneven, f"Set{name}Coordinates")(axis)
    points = vtk.vtkPoints()
    for k in range(size[2]):
        for j in range(size[1]):
            for i in range(size[0]):
                points.InsertNextPoint(i + 0.1 * j * k, j, k + 0.2 * i)
    bent.SetExtent(extent)
    bent.SetPoints(points)
    for grid in (image, uneven, bent):
        for data, count in ((grid.GetPointData(), grid.GetNumberOfPoints()), (grid.GetCellData(), grid.GetNumberOfCells())):
            for name in ("SignedChar", "UnsignedShort", "Int", "LongLong", "Float", "Double"):
                array = getattr(vtk, "vtk" + name + "Array")()
                array.SetName(name)
                array.SetNumberOfComponents(3 if name == "Double" else 1)
                array.SetNumberOfTuples(count)
                for i in range(array.GetNumberOfValues()):
                    array.SetValue(i, (i * 37 % 101) + (0.1 if name in ("Float", "Double") else 0))
                data.AddArray(array)
            data.SetActiveScalars("Float")
    return {"ImageData": image, "RectilinearGrid": uneven, "StructuredGrid": bent}


def write_blocks(folder):
    extensions = {"ImageData": "vti", "RectilinearGrid": "vtr", "StructuredGrid": "vts"}
    for kind, grid in blocks().items():
        for mode, compressor in (("Ascii", None), ("Binary", "ZLib"), ("Appended", None), ("Appended", "LZ4")):
            writer = getattr(vtk, f"vtkXML{kind}Writer")()
            writer.SetInputData(grid)
            writer.SetFileName(os.path.join(folder, f"{kind}_{mode}_{compressor}.{extensions[kind]}"))
            getattr(writer, "SetDataModeTo" + mode)()
            writer.SetEncodeAppendedData(compressor is not None)
            writer.SetCompressor(getattr(vtk, f"vtk{compressor}DataCompressor")() if compressor else None)
            writer.Write()
        for binary in (0, 1):
            writer = getattr(vtk, f"vtk{'StructuredPoints' if kind == 'ImageData' else kind}Writer")()
            straight = grid
            if kind == "ImageData":
                # Such files know no directions.
                straight = vtk.vtkImageData()
                straight.DeepCopy(grid)
                straight.SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1)
            writer.SetInputData(straight)
            writer.SetFileName(os.path.join(folder, f"{kind}_{binary}.vtk"))
            (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
            writer.Write()
        writer = getattr(vtk, f"vtkXMLP{kind}Writer")()
        # Lists of images tell no directions.
        writer.SetInputData(straight if kind == "ImageData" else grid)
        writer.SetFileName(os.path.join(folder, f"{kind}.p{extensions[kind]}"))
        writer.SetNumberOfPieces(3)
        writer.SetStartPiece(0)
        writer.SetEndPiece(2)
        writer.Write()


LINEAR = [(10, 1), (12, 1), (13, 1), (14, 1)]
CURVED = [(24, 2), (25, 2), (26, 2), (27, 2)] + [(t, o) for t in (71, 72, 73, 78, 79, 80) for o in (1, 2, 3, 5)]


def write(folder):
    # VTK 9.1 to 9.4, and maybe 9.6, loses numbers that are not finite in text, and bits in pieces.
    grids = {"linear": grid_of(LINEAR), "curved": grid_of(CURVED), "polyhedra": grid_of(LINEAR, True)}
    compressors = {"none": None, "zlib": "vtkZLibDataCompressor", "lz4": "vtkLZ4DataCompressor", "lzma": "vtkLZMADataCompressor"}
    for name, grid in grids.items():
        for mode in ("ascii", "binary", "base64", "raw"):
            for packed, compressor in compressors.items():
                for big in (0, 1):
                    if mode == "ascii" and (compressor or big):
                        continue
                    writer = vtk.vtkXMLUnstructuredGridWriter()
                    writer.SetInputData(without(grid, "Odd") if mode == "ascii" else grid)
                    writer.SetFileName(os.path.join(folder, f"{name}_{mode}_{packed}_{big}.vtu"))
                    getattr(writer, {"ascii": "SetDataModeToAscii", "binary": "SetDataModeToBinary"}.get(mode, "SetDataModeToAppended"))()
                    writer.SetEncodeAppendedData(mode == "base64")
                    writer.SetCompressor(getattr(vtk, compressor)() if compressor else None)
                    if compressor:
                        writer.SetBlockSize(4096)
                    (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
                    (writer.SetHeaderTypeToUInt64 if big else writer.SetHeaderTypeToUInt32)()
                    writer.Write()
        for version in (42, 51):
            for binary in (0, 1):
                writer = vtk.vtkUnstructuredGridWriter()
                writer.SetInputData(grid if binary else without(grid, "Odd"))
                writer.SetFileName(os.path.join(folder, f"{name}_{version}_{binary}.vtk"))
                writer.SetFileVersion(version)
                (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
                writer.Write()
        writer = vtk.vtkXMLPUnstructuredGridWriter()
        writer.SetInputData(without(grid, "Bit"))
        writer.SetFileName(os.path.join(folder, f"{name}.pvtu"))
        writer.SetNumberOfPieces(3)
        writer.SetStartPiece(0)
        writer.SetEndPiece(2)
        writer.Write()


if __name__ == "__main__":
    vtk.vtkObject.GlobalWarningDisplayOff()
    if sys.argv[1] == "write":
        write(sys.argv[2])
        write_blocks(sys.argv[2])
    else:
        with open(sys.argv[2], "wb") as out:
            for path in sys.argv[3:]:
                dump(out, path)
