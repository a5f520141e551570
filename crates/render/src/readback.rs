//! Reading buffers back.

use bytemuck::Pod;
use futures_channel::oneshot;

use crate::{Gpu, RenderError};

/// A buffer that the host can map, for `bytes` bytes.
pub(crate) fn host_buffer(device: &wgpu::Device, bytes: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    })
}

/// Maps a buffer whose copy was submitted, and reads all of it.
pub(crate) async fn read<T: Pod>(
    device: wgpu::Device,
    buffer: wgpu::Buffer,
) -> Result<Vec<T>, RenderError> {
    let failed = |message: String| RenderError::Device { message };
    let (sender, receiver) = oneshot::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |outcome| {
        // The future may have been dropped: nobody wants the data then.
        let _ = sender.send(outcome);
    });
    // With WebGPU a browser polls by itself, and this returns at once. With WebGL2 nobody may wait: whoever
    // awaits this polls the device between the page's tasks.
    match device.poll(wgpu::PollType::wait_indefinitely()) {
        Ok(_) | Err(wgpu::PollError::Timeout) => {}
        Err(error) => return Err(failed(error.to_string())),
    }
    match receiver.await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => return Err(failed(error.to_string())),
        Err(_) => return Err(failed("the device dropped a read-back".into())),
    }
    let view = buffer
        .get_mapped_range(..)
        .map_err(|error| failed(error.to_string()))?;
    Ok(bytemuck::pod_collect_to_vec(&view))
}

/// Reads an RGBA8 texture: rows from the top, tightly packed.
pub(crate) async fn read_texture(
    gpu: &Gpu,
    texture: &wgpu::Texture,
) -> Result<Vec<u8>, RenderError> {
    let row_bytes = texture.width() * 4;
    let padded_row_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let host = host_buffer(
        &gpu.device,
        u64::from(padded_row_bytes) * u64::from(texture.height()),
    );
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &host,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded_row_bytes),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu.queue.submit([encoder.finish()]);
    let padded: Vec<u8> = read(gpu.device.clone(), host).await?;
    gpu.check_health()?;
    let rows = padded.chunks(padded_row_bytes as usize);
    Ok(rows
        .flat_map(|row| &row[..row_bytes as usize])
        .copied()
        .collect())
}
