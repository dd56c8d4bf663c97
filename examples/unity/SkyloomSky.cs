// A sky of skyloom as the skybox of a scene of Unity, and its sun as the directional light of a Light component.
// x east, y up, z north. Light comes in kcd/m2 and klx and is multiplied by Exposure, as the built-in pipeline and URP have no camera's.
using System;
using System.Collections;
using System.Text;
using UnityEngine;
using UnityEngine.Networking;

public class SkyloomSky : MonoBehaviour
{
    public string server = "http://127.0.0.1:8080";
    public TextAsset scene;
    public int size = 512;
    public float timeSeconds = 0f;
    public float exposure = 0.05f;
    public Light sun;

    [Serializable] class Registered { public string id; }
    [Serializable] class Irradiance { public float[] facing_the_sun; }
    [Serializable] class Sun { public float[] direction; public Irradiance irradiance; }

    const int DdsHeader = 148; // with the header of Direct3D 10

    IEnumerator Start()
    {
        var body = Encoding.UTF8.GetBytes(scene != null ? scene.text : "{}");
        using var post = new UnityWebRequest(server + "/v1/skies", "POST");
        post.uploadHandler = new UploadHandlerRaw(body) { contentType = "application/json" };
        post.downloadHandler = new DownloadHandlerBuffer();
        yield return post.SendWebRequest();
        if (Failed(post)) yield break;
        var id = JsonUtility.FromJson<Registered>(post.downloadHandler.text).id;
        var sky = server + "/v1/skies/" + id;

        // The shader Skybox/Panoramic looks a quarter turn from where the render pipelines' own functions do: unity-builtin.
        using var get = UnityWebRequest.Get($"{sky}/sky.dds?axes=unity-builtin&size={size}&time={timeSeconds}&scale={exposure}");
        yield return get.SendWebRequest();
        if (Failed(get)) yield break;
        var texture = new Texture2D(2 * size, size, TextureFormat.RGBAHalf, false, true) { wrapModeU = TextureWrapMode.Repeat, wrapModeV = TextureWrapMode.Clamp };
        texture.SetPixelData(FromBelow(get.downloadHandler.data, 2 * size * 8, size), 0);
        texture.Apply(false, true);
        var material = new Material(Shader.Find("Skybox/Panoramic"));
        material.SetTexture("_MainTex", texture);
        material.SetFloat("_Mapping", 1f); // latitude, longitude
        material.EnableKeyword("_MAPPING_LATITUDE_LONGITUDE_LAYOUT");
        material.SetFloat("_Exposure", 1f);
        material.SetColor("_Tint", new Color(0.5f, 0.5f, 0.5f)); // of the shader: 1
        RenderSettings.skybox = material;
        DynamicGI.UpdateEnvironment();

        using var where = UnityWebRequest.Get($"{sky}/sun.json?time={timeSeconds}");
        yield return where.SendWebRequest();
        if (Failed(where) || sun == null) yield break;
        var told = JsonUtility.FromJson<Sun>(where.downloadHandler.text);
        var towards = new Vector3(told.direction[0], told.direction[2], told.direction[1]);
        sun.transform.rotation = Quaternion.LookRotation(-towards);
        var beam = told.irradiance.facing_the_sun;
        var most = Mathf.Max(beam[0], Mathf.Max(beam[1], beam[2]), 1e-9f);
        // An intensity of 1 lights a white surface to 1: pi times less than the irradiance. In HDRP it is lux: 1000 times klx, without exposure.
        sun.intensity = towards.y > 0f ? most * exposure / Mathf.PI : 0f;
        sun.color = new Color(beam[0] / most, beam[1] / most, beam[2] / most).gamma;
        RenderSettings.sun = sun;
    }

    static bool Failed(UnityWebRequest request)
    {
        if (request.result == UnityWebRequest.Result.Success) return false;
        Debug.LogError($"skyloom: {request.error} {request.downloadHandler?.text}");
        return true;
    }

    // Unity's rows go from the lower edge up.
    static byte[] FromBelow(byte[] file, int row, int rows)
    {
        var turned = new byte[row * rows];
        for (var y = 0; y < rows; y++) Buffer.BlockCopy(file, DdsHeader + y * row, turned, (rows - 1 - y) * row, row);
        return turned;
    }
}
