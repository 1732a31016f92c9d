"""Where frames come from: folders of pictures, videos, NumPy arrays, live cameras."""
