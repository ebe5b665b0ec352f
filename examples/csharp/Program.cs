// The library from C#, over its C header: a mesh in memory -> quads. Options are set by name, so that no structure of them is repeated here.
// mcs Program.cs && mono Program.exe, with the shared library where the loader finds it, as the tests do; the same source builds with .NET.
using System;
using System.Runtime.InteropServices;
using System.Text;

static class Quadwright
{
    // qw_mesh_view: a polygon mesh that somebody else owns.
    [StructLayout(LayoutKind.Sequential)]
    struct MeshView
    {
        public uint Size, VertexCount, FaceCount, UniformFaceSize;
        public IntPtr Positions, FaceSizes, Corners, MarkedEdges;
        public uint MarkedEdgeCount;
    }

    const string Library = "quadwright";
    [DllImport(Library)] static extern IntPtr qw_version();
    [DllImport(Library)] static extern UIntPtr qw_options_size();
    [DllImport(Library)] static extern void qw_options_init(IntPtr options);
    [DllImport(Library)] static extern int qw_option_set(IntPtr options, string name, string value, byte[] message, UIntPtr size);
    [DllImport(Library)] static extern int qw_options_preset(IntPtr options, string name, byte[] message, UIntPtr size);
    [DllImport(Library)] static extern int qw_remesh(ref MeshView input, IntPtr options, IntPtr host, out IntPtr result);
    [DllImport(Library)] static extern MeshView qw_result_mesh(IntPtr result);
    [DllImport(Library)] static extern IntPtr qw_result_message(IntPtr result);
    [DllImport(Library)] static extern void qw_result_destroy(IntPtr result);

    public static string Version { get { return Marshal.PtrToStringAnsi(qw_version()); } }

    static void Check(int status, byte[] message)
    {
        if (status != 0) throw new ArgumentException(Encoding.UTF8.GetString(message, 0, Math.Max(0, Array.IndexOf(message, (byte)0))));
    }

    // positions: three a vertex; triangles: three a face; options: name, value, name, value, ... Gives positions and quads, four corners each.
    public static Tuple<double[], int[]> Remesh(double[] positions, int[] triangles, string preset, params string[] options)
    {
        var message = new byte[256];
        var settings = Marshal.AllocHGlobal((int)qw_options_size().ToUInt32());
        GCHandle points = GCHandle.Alloc(positions, GCHandleType.Pinned), corners = GCHandle.Alloc(triangles, GCHandleType.Pinned);
        var result = IntPtr.Zero;
        try
        {
            qw_options_init(settings);
            Check(qw_options_preset(settings, preset, message, (UIntPtr)message.Length), message);
            for (int i = 0; i + 1 < options.Length; i += 2) Check(qw_option_set(settings, options[i], options[i + 1], message, (UIntPtr)message.Length), message);
            var input = new MeshView
            {
                Size = (uint)Marshal.SizeOf(typeof(MeshView)), VertexCount = (uint)positions.Length / 3, FaceCount = (uint)triangles.Length / 3,
                UniformFaceSize = 3, Positions = points.AddrOfPinnedObject(), Corners = corners.AddrOfPinnedObject()
            };
            if (qw_remesh(ref input, settings, IntPtr.Zero, out result) != 0) throw new InvalidOperationException(Marshal.PtrToStringAnsi(qw_result_message(result)));
            var mesh = qw_result_mesh(result); // copied, as the result owns it
            var made = Tuple.Create(new double[3 * mesh.VertexCount], new int[4 * mesh.FaceCount]);
            Marshal.Copy(mesh.Positions, made.Item1, 0, made.Item1.Length);
            Marshal.Copy(mesh.Corners, made.Item2, 0, made.Item2.Length);
            return made;
        }
        finally
        {
            if (result != IntPtr.Zero) qw_result_destroy(result);
            points.Free();
            corners.Free();
            Marshal.FreeHGlobal(settings);
        }
    }
}

static class Program
{
    static int Main()
    {
        var cube = new double[24];
        for (int i = 0; i < 8; i++) { cube[3 * i] = i & 1; cube[3 * i + 1] = i >> 1 & 1; cube[3 * i + 2] = i >> 2; }
        int[] triangles = { 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5 };
        var made = Quadwright.Remesh(cube, triangles, "cad", "faces", "600");
        int quads = made.Item2.Length / 4, vertices = made.Item1.Length / 3;
        Console.WriteLine("quadwright {0}: {1} quads, {2} vertices", Quadwright.Version, quads, vertices);
        foreach (int v in made.Item2) if (v < 0 || v >= vertices) return 1;
        if (quads < 550 || quads > 650) return 1;
        try { Quadwright.Remesh(cube, triangles, "cad", "faces", "many"); return 1; }
        catch (ArgumentException error) { return error.Message.Contains("faces") ? 0 : 1; }
    }
}
